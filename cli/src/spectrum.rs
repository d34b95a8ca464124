//! `lobes spectrum`: what the light itself looks like in frequency.

use comfy_table::{CellAlignment, Table, presets};
use serde_json::json;

use crate::arguments::Spectrum;
use crate::error::{Error, Result};
use crate::report::light_spectra;
use crate::{console, input, output, progress};
use lobes::Parallelism;
use lobes::illumination::{EnvironmentMap, LightSpectrum, builtin};

/// The largest degree, unless said.
const DEGREE: usize = 128;

pub(super) fn run(options: &Spectrum) -> Result<()> {
    let degree = options.degree.unwrap_or(DEGREE);
    let (maps, spectra) = if options.files.is_empty() {
        let maps = builtin()?;
        let spectra = analyse(&maps, degree)?;
        (maps, spectra)
    } else {
        of_files(options, degree)?
    };
    let failed = options.files.len().saturating_sub(maps.len());
    if !maps.is_empty() {
        answer(options, &maps, &spectra)?;
    }
    if options.files.len() > 1 && failed > 0 {
        return Err(Error::Partly {
            failed,
            total: options.files.len(),
            what: "maps have no spectrum here, for the reasons above".into(),
        });
    }
    Ok(())
}

/// The maps of files and their spectra; of many the bad ones are told and left out, of one alone it
/// is the error.
fn of_files(
    options: &Spectrum,
    degree: usize,
) -> Result<(Vec<EnvironmentMap>, Vec<LightSpectrum>)> {
    let alone = options.files.len() == 1;
    let bar = progress::bar(options.files.len(), "spectra");
    let all = Parallelism::Rayon.map(options.files.len(), |i| {
        let file = &options.files[i];
        let found = input::map(file, options.mapping).and_then(|map| {
            let spectrum = LightSpectrum::of(&map, degree, Parallelism::Sequential)
                .map_err(|error| input::error_of(file, error.into()))?;
            Ok((map, spectrum))
        });
        bar.inc(1);
        found
    });
    bar.finish_and_clear();
    let (mut maps, mut spectra) = (Vec::new(), Vec::new());
    for (file, found) in options.files.iter().zip(all) {
        match found {
            Ok((map, spectrum)) => {
                let limit = map.max_degree()?;
                if options.degree.is_some_and(|degree| degree > limit) {
                    console::complain(format!(
                        "lobes: {}: degree {degree} is beyond {limit}, the largest that its {} rows carry; the spectrum ends there",
                        input::name(file),
                        map.height()
                    ));
                }
                maps.push(map);
                spectra.push(spectrum);
            }
            Err(error) if alone => return Err(error),
            Err(error) => {
                console::json(&json!({ "map": input::name(file), "error": error.to_string() }))?;
                console::complain(format!("lobes: {error}"));
            }
        }
    }
    Ok((maps, spectra))
}

fn answer(options: &Spectrum, maps: &[EnvironmentMap], spectra: &[LightSpectrum]) -> Result<()> {
    console::answer(table(maps, spectra).to_string());
    let (first, last) = LightSpectrum::FIT_RANGE;
    console::answer(format!(
        "η, k: the law k / l^(2+η) fitted to the luminance for l = {first} … {last}, or to the map's last degree. \
         coherence: of red and blue, 1 for light of one colour. clipped η: with the brightest {} % of the \
         sphere clipped.",
        100.0 * LightSpectrum::CLIPPED_SHARE,
    ));
    for (map, spectrum) in maps.iter().zip(spectra) {
        console::json(&json!({
            "map": map.name(),
            "k": spectrum.law.k,
            "eta": spectrum.law.eta,
            "eta_error": spectrum.law.eta_error,
            "ln_k_error": spectrum.law.ln_k_error,
            "eta_of_channels": spectrum.etas,
            "coherence": spectrum.coherence,
            "clipped_eta": spectrum.clipped_eta,
            "luminance": spectrum.luminance,
            "channels": spectrum.channels,
        }))?;
    }
    let Some(path) = &options.plot else {
        return Ok(());
    };
    let named: Vec<(String, Vec<f64>)> = maps
        .iter()
        .zip(spectra)
        .map(|(map, spectrum)| (map.name().to_owned(), spectrum.luminance.clone()))
        .collect();
    let plot = light_spectra(&named, median_eta(spectra));
    output::write_file(path, plot.as_bytes())?;
    console::note(format!("wrote {}", path.display()));
    Ok(())
}

/// The spectra of every map, with progress.
pub(super) fn analyse(maps: &[EnvironmentMap], degree: usize) -> Result<Vec<LightSpectrum>> {
    let bar = progress::bar(maps.len(), "spectra");
    let spectra = Parallelism::Rayon.map(maps.len(), |i| {
        let spectrum = LightSpectrum::of(&maps[i], degree, Parallelism::Sequential);
        bar.inc(1);
        spectrum.map_err(|error| Error::of(maps[i].name(), error))
    });
    bar.finish_and_clear();
    spectra.into_iter().collect()
}

/// The median exponent.
pub(super) fn median_eta(spectra: &[LightSpectrum]) -> f64 {
    let mut etas: Vec<f64> = spectra.iter().map(|s| s.law.eta).collect();
    etas.sort_by(f64::total_cmp);
    etas[etas.len() / 2]
}

/// A number with so many decimals, or a dash where there is none.
fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "–".into(), |value| format!("{value:.decimals$}"))
}

fn table(maps: &[EnvironmentMap], spectra: &[LightSpectrum]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header([
        "map",
        "η",
        "k",
        "η red",
        "η green",
        "η blue",
        "coherence",
        "clipped η",
    ]);
    for (map, spectrum) in maps.iter().zip(spectra) {
        let law = spectrum.law;
        let [red, green, blue] = spectrum.etas;
        table.add_row([
            map.name().to_owned(),
            format!("{:.2} ± {:.2}", law.eta, law.eta_error),
            format!("{:.2e}", law.k),
            number(red, 2),
            number(green, 2),
            number(blue, 2),
            number(spectrum.coherence, 3),
            number(spectrum.clipped_eta, 2),
        ]);
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}
