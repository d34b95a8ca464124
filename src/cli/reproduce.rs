//! `lobes reproduce`: the paper's figures and table, from maps of real light.

use comfy_table::{CellAlignment, Table, presets};
use serde_json::json;

use crate::classify::{
    Dataset, Evaluation, NearestNeighbour, Scaling, leave_one_illumination_out, paper_dataset,
};
use crate::cli::arguments::Reproduce;
use crate::cli::output::OutputFolder;
use crate::cli::{lights, materials, progress, slug, spectrum};
use crate::features::{Continuation, ImageSpectrum, PaperFeatures, TOP_DEGREE};
use crate::files::{self, Precision, encode_exr};
use crate::illumination::{EnvironmentMap, LightSpectrum, Luminance};
use crate::reflectance::{Material, Variant};
use crate::reflection::{Settings, SphereImage};
use crate::report::{
    AccuracyFile, AccuracyRow, Figure, NamedConfusion, Page, confusion_matrix, encode_png,
    feature_plane, light_spectra,
};
use crate::{Error, Parallelism, Result};

/// The degree to which the page shows the spectra of the light.
const LIGHT_DEGREE: usize = 128;

/// The exposure of the pictures of spheres; 1 is the mean of the white sphere, which leaves its bright side room.
const PICTURE_EXPOSURE: f64 = 0.5;

/// What the paper prints: (what, accuracy in per cent, of how many).
const PAPER: [(&str, f64, &str); 2] = [
    ("as the paper reports", 94.4, "68/72"),
    ("Dror et al., as the paper reports", 78.8, "–"),
];

/// The continuations whose features have odd degrees.
const CONTINUATIONS: [Continuation; 3] = [
    Continuation::Mirror,
    Continuation::HalfTurn,
    Continuation::Zero,
];

/// One row with all that made it.
struct Row {
    row: AccuracyRow,
    evaluation: Evaluation,
    /// Whether it is what the options name: the continuation, the default scaling, the first lobe.
    chosen: bool,
}

pub(super) fn run(options: &Reproduce) -> Result<()> {
    if !CONTINUATIONS.contains(&options.continuation) {
        return Err(Error::Unanswerable(format!(
            "the features need odd degrees, which the {} continuation does not have; use mirror, half-turn or zero",
            options.continuation
        )));
    }
    let mut output = OutputFolder::open(&options.out)?;
    let materials = materials::load(&options.materials)?;
    let maps = lights::load(&options.lights)?;
    if maps.len() < 2 {
        return Err(Error::Unanswerable(format!(
            "leaving one illumination out needs at least two maps and there is only {:?}; add maps to the folder",
            maps[0].name()
        )));
    }
    let spectra = spectrum::analyse(&maps, LIGHT_DEGREE)?;
    let settings = Settings {
        size: options.size,
        ..Settings::default()
    };

    let mut rows = Vec::new();
    let mut first: Option<(Dataset, Vec<PaperFeatures>)> = None;
    for &lobe in &options.lobes {
        let bar = progress::bar(maps.len(), "spheres");
        let data = paper_dataset(
            &maps,
            &materials,
            lobe,
            &settings,
            Parallelism::Rayon,
            &|| bar.inc(1),
        )?;
        bar.finish_and_clear();
        for continuation in CONTINUATIONS {
            let features = features(&data, continuation)?;
            let chosen =
                continuation == options.continuation && Some(&lobe) == options.lobes.first();
            rows.extend(nearest_neighbour(
                &data,
                &features,
                lobe,
                continuation,
                chosen,
            )?);
            if chosen {
                first = Some((data.clone(), features));
            }
        }
    }
    let Some((data, features)) = first else {
        return Err(Error::Unanswerable("name a lobe with --lobe".into()));
    };

    let accuracy = AccuracyFile {
        lobes: env!("CARGO_PKG_VERSION").to_owned(),
        settings: describe(options, &settings, &materials, &maps, &data),
        rows: rows.iter().map(|row| row.row.clone()).collect(),
    };
    println!("{}", table(&rows));
    let mut json = serde_json::to_string_pretty(&accuracy)
        .map_err(|error| Error::Unanswerable(format!("the table has no JSON form: {error}")))?;
    json.push('\n');
    output.add("accuracy.json", json);
    let page = write_page(
        &mut output,
        options,
        &rows,
        &maps,
        &spectra,
        &materials,
        &data,
        &features,
    )?;
    output.add("index.html", page);
    output.commit()?;
    println!("wrote {}", options.out.join("index.html").display());
    Ok(())
}

/// The features of every image.
fn features(data: &Dataset, continuation: Continuation) -> Result<Vec<PaperFeatures>> {
    let plan = ImageSpectrum::new(TOP_DEGREE, continuation)?;
    let all = Parallelism::Rayon.map(data.observations.len(), |i| {
        PaperFeatures::of_image(&plan, &data.observations[i].image)
    });
    all.into_iter().collect()
}

/// The rows of every scaling.
fn nearest_neighbour(
    data: &Dataset,
    features: &[PaperFeatures],
    lobe: Variant,
    continuation: Continuation,
    chosen: bool,
) -> Result<Vec<Row>> {
    let arrays: Vec<[f64; 10]> = features.iter().map(PaperFeatures::to_array).collect();
    let (labels, groups) = (data.labels(), data.groups());
    let count = data.materials.len();
    let row = |scaling| {
        let classifier = NearestNeighbour::new(scaling, &arrays, &labels, count)?;
        let evaluation =
            leave_one_illumination_out(&classifier, &labels, &groups, count, Parallelism::Rayon)?;
        let confusions = evaluation.confusions().into_iter().map(|c| NamedConfusion {
            illumination: data.illuminations[groups[c.observation]].clone(),
            truth: data.materials[c.truth].clone(),
            said: data.materials[c.said].clone(),
        });
        let row = AccuracyRow::new(
            "paper",
            "nearest-neighbour",
            scaling.name(),
            continuation.name(),
            lobe.name(),
            &evaluation,
            confusions.collect(),
        );
        Ok(Row {
            row,
            evaluation,
            chosen: chosen && scaling == Scaling::default(),
        })
    };
    Scaling::ALL.into_iter().map(row).collect()
}

/// What was set, for `accuracy.json`.
fn describe(
    options: &Reproduce,
    settings: &Settings,
    materials: &[Material],
    maps: &[EnvironmentMap],
    data: &Dataset,
) -> serde_json::Value {
    json!({
        "camera": "level, orthographic",
        "size": settings.size,
        "tolerance": settings.tolerance,
        "render_error": data.render_error,
        "top_degree": TOP_DEGREE,
        "scaling_by": "mean luminance of a white sphere in the same light",
        "reading": if options.materials.as_albedos { "albedos" } else { "as given" },
        "materials": materials.iter().map(|m| json!({
            "name": m.name(), "diffuse": m.diffuse(), "specular": m.specular(),
            "sigma": m.roughness().sigma(),
        })).collect::<Vec<_>>(),
        "illuminations": maps.iter().map(EnvironmentMap::name).collect::<Vec<_>>(),
    })
}

/// The columns of one row, as people read them.
fn columns(row: &AccuracyRow) -> Vec<String> {
    vec![
        row.protocol.clone(),
        row.classifier.clone(),
        row.scaling.clone(),
        row.continuation.clone(),
        row.lobe.clone(),
        format!("{}/{}", row.correct, row.total),
        format!("{:.1} %", 100.0 * row.accuracy),
        format!("{:.1} – {:.1}", 100.0 * row.ci95[0], 100.0 * row.ci95[1]),
    ]
}

const HEADINGS: [&str; 8] = [
    "protocol",
    "classifier",
    "scaling",
    "behind",
    "lobe",
    "correct#",
    "accuracy#",
    "95 % interval#",
];

/// The rows of the paper itself, in the same columns.
fn paper_rows() -> Vec<Vec<String>> {
    let rows = PAPER.iter().map(|(what, accuracy, count)| {
        let mut row = vec!["–".to_owned(); HEADINGS.len()];
        row[0] = "paper".into();
        row[1] = (*what).into();
        row[5] = (*count).into();
        row[6] = format!("{accuracy:.1} %");
        row
    });
    rows.collect()
}

fn table(rows: &[Row]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(HEADINGS.map(|h| h.trim_end_matches('#')));
    for row in rows {
        table.add_row(columns(&row.row));
    }
    for row in paper_rows() {
        table.add_row(row);
    }
    for (i, heading) in HEADINGS.iter().enumerate() {
        if let (true, Some(column)) = (heading.ends_with('#'), table.column_mut(i)) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table
}

/// Adds the page's pictures to the output and gives the page.
#[expect(
    clippy::too_many_arguments,
    reason = "the page shows all that the verb has made"
)]
fn write_page(
    output: &mut OutputFolder,
    options: &Reproduce,
    rows: &[Row],
    maps: &[EnvironmentMap],
    spectra: &[LightSpectrum],
    materials: &[Material],
    data: &Dataset,
    features: &[PaperFeatures],
) -> Result<String> {
    let lobe = options.lobes[0];
    let chosen = rows.iter().find(|row| row.chosen).unwrap_or(&rows[0]);
    let mut page = Page::new(
        "Reading materials off spheres under natural light",
        &format!(
            "Natural light has regular statistics and a surface filters them. From the power spectrum of one \
             image of a sphere, and with no picture under the same light to learn from, the paper's features \
             name {} of {} spheres right ({:.1} %, 95 % interval {:.1} – {:.1}); the paper reports 94.4 % on its own nine maps.",
            chosen.row.correct,
            chosen.row.total,
            100.0 * chosen.row.accuracy,
            100.0 * chosen.row.ci95[0],
            100.0 * chosen.row.ci95[1],
        ),
    );

    page.heading("Accuracy (the paper's Table 1)");
    page.paragraph(
        "Nearest neighbour, leaving all images of one illumination out at a time. The paper does not say how features \
         are scaled before distances are taken, so every scaling is here; the marked row is the default, chosen \
         because powers and radiances are compared by their ratios.",
    );
    let mut table: Vec<(&str, Vec<String>)> = rows
        .iter()
        .map(|row| (if row.chosen { "strong" } else { "" }, columns(&row.row)))
        .collect();
    table.extend(paper_rows().into_iter().map(|row| ("quoted", row)));
    page.table(&HEADINGS, &table);
    output.add(
        "figures/confusion.svg",
        confusion_matrix(&data.materials, &chosen.evaluation.confusion_matrix()),
    );
    page.figure(&Figure {
        path: "figures/confusion.svg".into(),
        caption: vec!["Confusion matrix of the marked row".into()],
    });
    if !chosen.row.confusions.is_empty() {
        let wrong: Vec<(&str, Vec<String>)> = chosen
            .row
            .confusions
            .iter()
            .map(|c| {
                (
                    "",
                    vec![c.illumination.clone(), c.truth.clone(), c.said.clone()],
                )
            })
            .collect();
        page.table(&["illumination", "truth", "said"], &wrong);
    }

    page.heading("The light in frequency (Figure 1)");
    let named: Vec<(String, Vec<f64>)> = maps
        .iter()
        .zip(spectra)
        .map(|(map, spectrum)| (map.name().to_owned(), spectrum.luminance.clone()))
        .collect();
    let eta = spectrum::median_eta(spectra);
    output.add("figures/light.svg", light_spectra(&named, eta));
    let mut clipped: Vec<f64> = spectra.iter().map(|s| s.clipped_eta).collect();
    clipped.sort_by(f64::total_cmp);
    page.paragraph(&format!(
        "The average power of each degree falls as k / l^(2+η). A small bright sun or lamp has as much power at every \
         degree (η = −2) and hides the rest: the median η over these maps is {eta:.2}, and {:.2} once the brightest {} % \
         of the sphere are clipped. Hover over a line for its name.",
        clipped[clipped.len() / 2],
        100.0 * LightSpectrum::CLIPPED_SHARE,
    ));
    page.figure(&Figure {
        path: "figures/light.svg".into(),
        caption: vec!["Power spectra of the luminance of every illumination".into()],
    });

    page.heading("Materials in the plane of v1 and v2 (Figure 2)");
    let plane: Vec<(usize, f64, f64)> = data
        .observations
        .iter()
        .zip(features)
        .map(|(o, f)| (o.material, f.power[0], f.power[1]))
        .collect();
    output.add("figures/plane.svg", feature_plane(&data.materials, &plane));
    page.paragraph(
        "The paper predicts v2 near 0 for matte spheres, which reflect no odd degree past 1. With the unseen \
         half filled by the mirrored front it is not: the mirrored field has a crease along the rim, and a crease has \
         power at every degree.",
    );
    page.figure(&Figure {
        path: "figures/plane.svg".into(),
        caption: vec![format!(
            "One symbol an image; unseen half: {}",
            options.continuation
        )],
    });

    page.heading("The spheres (Figure 3)");
    let shown = 0;
    page.paragraph(&format!(
        "The {} materials under “{}”, scaled by its white sphere; lobe {lobe}. The PNGs are clipped at 1 and \
         encoded as sRGB; spheres/ also has each as linear EXR.",
        materials.len(),
        data.illuminations[shown],
    ));
    let mut pictures = Vec::new();
    for observation in data.observations.iter().filter(|o| o.illumination == shown) {
        let material = &materials[observation.material];
        let stem = format!(
            "spheres/{:02}-{}",
            observation.material + 1,
            slug(material.name())
        );
        let size = observation.image.size();
        output.add(
            format!("{stem}.png"),
            encode_png(size, size, PICTURE_EXPOSURE, |row, column| {
                observation.image.get(row, column)
            })?,
        );
        output.add(format!("{stem}.exr"), sphere_exr(&observation.image)?);
        pictures.push(Figure {
            path: format!("{stem}.png"),
            caption: vec![
                material.name().to_owned(),
                format!(
                    "ρd {}, ρs {}, σ {}",
                    rgb(material.diffuse()),
                    rgb(material.specular()),
                    material.roughness().sigma()
                ),
            ],
        });
    }
    page.grid(4, &pictures);
    let shown: Vec<&SphereImage> = data
        .observations
        .iter()
        .filter(|o| o.illumination == shown)
        .map(|o| &o.image)
        .collect();
    output.add("figures/spheres.png", contact_sheet(&shown, 4)?);

    page.heading("The illuminations");
    let mut pictures = Vec::new();
    for (i, (map, spectrum)) in maps.iter().zip(spectra).enumerate() {
        let path = format!("illuminations/{:02}-{}.png", i + 1, slug(map.name()));
        output.add(path.clone(), thumbnail(map)?);
        pictures.push(Figure {
            path,
            caption: vec![
                map.name().to_owned(),
                format!(
                    "η = {:.2} ± {:.2}; clipped {:.2}",
                    spectrum.law.eta, spectrum.law.eta_error, spectrum.clipped_eta
                ),
            ],
        });
    }
    page.grid(4, &pictures);
    Ok(page.html(&format!(
        "lobes {}: {} maps, {} materials, {}² pixels, tolerance {:e}. The numbers are in accuracy.json.",
        env!("CARGO_PKG_VERSION"),
        maps.len(),
        materials.len(),
        options.size,
        Settings::default().tolerance,
    )))
}

/// Images of one size side by side, `columns` in a row.
fn contact_sheet(images: &[&SphereImage], columns: usize) -> Result<Vec<u8>> {
    let margin = 8;
    let cell = images[0].size() + margin;
    let rows = images.len().div_ceil(columns);
    encode_png(
        columns * cell + margin,
        rows * cell + margin,
        PICTURE_EXPOSURE,
        |row, column| {
            let (row, column) = (row.checked_sub(margin)?, column.checked_sub(margin)?);
            let image = images.get(row / cell * columns + column / cell)?;
            image.get(row % cell, column % cell)
        },
    )
}

/// A map as a small picture, its mean at a middle grey.
fn thumbnail(map: &EnvironmentMap) -> Result<Vec<u8>> {
    let (width, height) = (256, 128);
    let exposure = 0.25 / Luminance::Rec709.of(map.mean());
    let (rows, columns) = (map.height(), map.width());
    encode_png(width, height, exposure, |row, column| {
        // The mean of the pixels under this one, of at least one.
        let (row0, row1) = (row * rows / height, ((row + 1) * rows).div_ceil(height));
        let (column0, column1) = (
            column * columns / width,
            ((column + 1) * columns).div_ceil(width),
        );
        let mut sum = [0.0; 3];
        for row in row0..row1 {
            for column in column0..column1 {
                for (sum, value) in sum.iter_mut().zip(map.pixel(row, column)) {
                    *sum += value;
                }
            }
        }
        let count = ((row1 - row0) * (column1 - column0)) as f64;
        Some(sum.map(|value| value / count))
    })
}

/// A sphere as linear EXR, black where there is none.
pub(super) fn sphere_exr(image: &SphereImage) -> Result<Vec<u8>> {
    let size = image.size();
    let pixels = (0..size * size)
        .map(|i| image.get(i / size, i % size).unwrap_or_default())
        .collect();
    encode_exr(
        &files::Picture {
            width: size,
            height: size,
            pixels,
        },
        Precision::Single,
    )
}

/// A colour in a caption: one number where it is grey.
fn rgb(colour: [f64; 3]) -> String {
    if colour[0] == colour[1] && colour[1] == colour[2] {
        format!("{:.3}", colour[0])
    } else {
        let parts = colour.map(|c| format!("{c:.2}"));
        format!("({})", parts.join(", "))
    }
}
