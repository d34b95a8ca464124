//! The page that `lobes reproduce` writes.

use crate::Result;
use crate::classify::{Dataset, Reading};
use crate::cli::arguments::Reproduce;
use crate::cli::output::OutputFolder;
use crate::cli::{slug, spectrum};
use crate::features::PaperFeatures;
use crate::illumination::{EnvironmentMap, LightSpectrum, Luminance};
use crate::reflectance::Material;
use crate::reflection::{Settings, SphereImage};
use crate::report::{
    Figure, Page, calibration, confusion_matrix, encode_png, feature_plane, light_spectra,
};

use super::{Beyond, HEADINGS, Row, Shown, columns, paper_rows, shown, sphere_exr};

/// The exposure of the pictures of spheres; 1 is the mean of the white sphere, which leaves its bright side room.
const PICTURE_EXPOSURE: f64 = 0.5;

/// Adds the page's pictures to the output and gives the page.
#[expect(
    clippy::too_many_arguments,
    reason = "the page shows all that the verb has made"
)]
pub(super) fn write_page(
    output: &mut OutputFolder,
    options: &Reproduce,
    continuation: usize,
    rows: &[Row],
    beyond: &Beyond,
    maps: &[EnvironmentMap],
    spectra: &[LightSpectrum],
    materials: &[Material],
    data: &Dataset<Reading>,
) -> Result<String> {
    let pictures_of = shown(data);
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
    )?;
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

    if !beyond.rows.is_empty() {
        page.heading("Beyond the paper: every classifier under every protocol");
        page.paragraph(
            "“Finish right” counts a picture whose material was taken for another of the same finish (matte, glossy plastic, \
             rough metal, smooth metal) too: the colour of a body and that of the light cannot be told apart without a highlight. p is McNemar's \
             exact test against the combined classifier. docs/inference.md explains the classifiers.",
        );
        let table: Vec<(&str, Vec<String>)> = beyond
            .rows
            .iter()
            .map(|row| {
                let class = if row.chosen { "strong" } else { "" };
                (class, beyond.columns(&row.row))
            })
            .collect();
        page.table(&Beyond::HEADINGS, &table);
        if !beyond.ceilings.is_empty() {
            page.paragraph(
                "How good can anyone be? From the spread of the colours of these maps: how often the best rule tells two \
                 materials apart that differ in colour alone, and how many pictures are right if nothing else is mixed up.",
            );
            let rows = beyond.ceiling_rows().into_iter();
            let table: Vec<(&str, Vec<String>)> = rows.map(|row| ("", row)).collect();
            page.table(&Beyond::CEILING_HEADINGS, &table);
        }
        let mut pictures = Vec::new();
        for row in beyond.rows.iter().filter(|row| row.chosen) {
            let path = format!("figures/confusion-{}.svg", row.row.protocol);
            output.add(
                path.clone(),
                confusion_matrix(&data.materials, &row.evaluation.confusion_matrix()),
            )?;
            pictures.push(Figure {
                path,
                caption: vec![format!("{}: the combined classifier", row.row.protocol)],
            });
        }
        page.grid(2, &pictures);
    }

    if let Some(row) = beyond.continuous.last() {
        page.heading("Reading σ and the specular share off a picture");
        let rows = beyond.continuous.iter();
        let table: Vec<(&str, Vec<String>)> = rows
            .map(|row| ("", Beyond::continuous_columns(row)))
            .collect();
        page.table(&Beyond::CONTINUOUS_HEADINGS, &table);
        output.add("figures/calibration.svg", calibration(&row.coverage))?;
        page.figure(&Figure {
            path: "figures/calibration.svg".into(),
            caption: vec!["How often credible intervals hold the truth".into()],
        });
    }

    page.heading("The light in frequency (Figure 1)");
    let named: Vec<(String, Vec<f64>)> = maps
        .iter()
        .zip(spectra)
        .map(|(map, spectrum)| (map.name().to_owned(), spectrum.luminance.clone()))
        .collect();
    let eta = spectrum::median_eta(spectra);
    output.add("figures/light.svg", light_spectra(&named, eta))?;
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
    let plane: Vec<(usize, f64, f64)> = pictures_of
        .iter()
        .map(|s| {
            let features: &PaperFeatures = &s.judged.paper[continuation];
            (s.observation.material, features.power[0], features.power[1])
        })
        .collect();
    output.add("figures/plane.svg", feature_plane(&data.materials, &plane))?;
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
    let of_first: Vec<&Shown> = pictures_of
        .iter()
        .filter(|s| s.observation.illumination == shown)
        .collect();
    for Shown {
        observation,
        judged,
    } in &of_first
    {
        let material = &materials[observation.material];
        let image = &judged.image;
        let stem = format!(
            "spheres/{:02}-{}",
            observation.material + 1,
            slug(material.name())
        );
        let size = image.size();
        output.add(
            format!("{stem}.png"),
            encode_png(size, size, PICTURE_EXPOSURE, |row, column| {
                image.get(row, column)
            })?,
        )?;
        output.add(format!("{stem}.exr"), sphere_exr(image)?)?;
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
    let shown: Vec<&SphereImage> = of_first.iter().map(|s| &s.judged.image).collect();
    output.add("figures/spheres.png", contact_sheet(&shown, 4)?)?;

    page.heading("The illuminations");
    let mut pictures = Vec::new();
    for (i, (map, spectrum)) in maps.iter().zip(spectra).enumerate() {
        let path = format!("illuminations/{:02}-{}.png", i + 1, slug(map.name()));
        output.add(path.clone(), thumbnail(map)?)?;
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

/// A colour in a caption: one number where it is grey.
fn rgb(colour: [f64; 3]) -> String {
    if colour[0] == colour[1] && colour[1] == colour[2] {
        format!("{:.3}", colour[0])
    } else {
        let parts = colour.map(|c| format!("{c:.2}"));
        format!("({})", parts.join(", "))
    }
}
