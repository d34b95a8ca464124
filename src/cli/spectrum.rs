//! `lobes spectrum`: what the light itself looks like in frequency.

use comfy_table::{CellAlignment, Table, presets};
use serde_json::json;

use crate::cli::arguments::Spectrum;
use crate::cli::{console, output, progress};
use crate::illumination::{EnvironmentMap, LightSpectrum, builtin, read};
use crate::report::light_spectra;
use crate::{Parallelism, Result};

pub(super) fn run(options: &Spectrum) -> Result<()> {
    let maps = if options.files.is_empty() {
        builtin()?
    } else {
        let files = options.files.iter();
        files
            .map(|file| read(file, options.mapping))
            .collect::<Result<Vec<_>>>()?
    };
    let spectra = analyse(&maps, options.degree)?;
    console::answer(table(&maps, &spectra).to_string());
    let (first, last) = LightSpectrum::FIT_RANGE;
    console::answer(format!(
        "η, k: the law k / l^(2+η) fitted to the luminance for l = {first} … {last}, or to the map's last degree. \
         coherence: of red and blue, 1 for light of one colour. clipped η: with the brightest {} % of the \
         sphere clipped.",
        100.0 * LightSpectrum::CLIPPED_SHARE,
    ));
    for (map, spectrum) in maps.iter().zip(&spectra) {
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
    let named: Vec<(String, Vec<f64>)> = maps
        .iter()
        .zip(&spectra)
        .map(|(map, spectrum)| (map.name().to_owned(), spectrum.luminance.clone()))
        .collect();
    let plot = light_spectra(&named, median_eta(&spectra));
    output::write_file(&options.plot, plot.as_bytes())?;
    console::note(format!("wrote {}", options.plot.display()));
    Ok(())
}

/// The spectra of every map, with progress.
pub(super) fn analyse(maps: &[EnvironmentMap], degree: usize) -> Result<Vec<LightSpectrum>> {
    let bar = progress::bar(maps.len(), "spectra");
    let spectra = Parallelism::Rayon.map(maps.len(), |i| {
        let spectrum = LightSpectrum::of(&maps[i], degree, Parallelism::Sequential);
        bar.inc(1);
        spectrum
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
            format!("{:.2}", spectrum.clipped_eta),
        ]);
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}
