//! `lobes fit`: Ward's parameters of a measured surface.

use std::path::Path;

use comfy_table::{CellAlignment, Table, presets};
use serde_json::json;

use crate::arguments::Fit;
use crate::error::{Error, Result};
use crate::report::{Axis, Chart, Mark, Naming, Series};
use crate::{console, input, output};
use lobes::reflectance::Ward;
use lobes::reflectance::fit::{self, Estimate, Measurement, Widths};

/// The most points of a channel that the plot shows.
const PLOTTED: usize = 2000;

pub(super) fn run(options: &Fit) -> Result<()> {
    let lobe = options.lobe.name;
    let widths = if options.anisotropic {
        // Says so where the lobe has no second width.
        Ward::anisotropic(lobe, 0.1, 0.2)
            .map_err(|error| Error::request(error.to_string(), "name another lobe with --lobe"))?;
        Widths::Two
    } else {
        Widths::One
    };
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["channel", "ρd", "ρs", "σx", "σy", "residual", "values"]);
    let mut series = Vec::new();
    let mut answers = Vec::new();
    for (name, colour, measurements) in channels(&options.file)? {
        let found = fit::fit(&measurements, lobe, widths).map_err(|error| {
            Error::file(
                input::name(&options.file),
                format!("no lobe can be fitted to its {name}: {error}"),
                "what is fitted is a Lambert body and a lobe, to measurements in the highlight and beside it",
            )
        })?;
        table.add_row([
            name.to_owned(),
            estimate(found.diffuse),
            estimate(found.specular),
            estimate(found.sigma[0]),
            estimate(found.sigma[1]),
            format!("{:.2e}", found.residual),
            found.measurements.to_string(),
        ]);
        for (symbol, albedo) in [("ρd", found.diffuse), ("ρs", found.specular)] {
            if albedo.value < -2.0 * albedo.standard_error {
                console::note(format!(
                    "{}: {symbol} of its {name} is negative, {:.4}: a Lambert body and a {} lobe are not what this surface is",
                    options.file.display(),
                    albedo.value,
                    options.lobe.name
                ));
            }
        }
        let number = |e: Estimate| json!({ "value": e.value, "standard_error": e.standard_error });
        answers.push(json!({
            "file": input::name(&options.file),
            "channel": name,
            "lobe": lobe.name(),
            "diffuse": number(found.diffuse),
            "specular": number(found.specular),
            "sigma": found.sigma.map(number),
            "residual": found.residual,
            "measurements": found.measurements,
            "steps": found.steps,
        }));
        let residuals = fit::residuals(&measurements, &found)?;
        let every = residuals.len().div_ceil(PLOTTED);
        series.push(Series {
            name: name.to_owned(),
            naming: Naming::Legend,
            colour: colour.to_owned(),
            mark: Mark::Symbol(0),
            points: residuals
                .iter()
                .step_by(every)
                .map(|r| (r.delta.to_degrees(), r.measured - r.fitted))
                .collect(),
        });
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    console::answer(table.to_string());
    console::answer(format!(
        "lobe {lobe}; ± one standard error; residual: RMS of f cos θ less its fit."
    ));
    for answer in &answers {
        console::json(answer)?;
    }
    let Some(plot) = &options.plot else {
        return Ok(());
    };
    let chart = Chart {
        title: format!("Residuals of the {lobe} lobe"),
        x_label: "angle from the normal to the half vector, degrees".into(),
        y_label: "f cos θ, measured − fitted (1/sr)".into(),
        x_axis: Axis::Linear,
        y_axis: Axis::Linear,
        series,
    };
    output::write_file(plot, chart.svg().as_bytes())?;
    console::note(format!("wrote {}", plot.display()));
    Ok(())
}

/// A channel's name, the colour that it is plotted in, and its measurements.
type Channel = (&'static str, &'static str, Vec<Measurement>);

/// MERL's channels.
const MERL: [(&str, &str); 3] = [
    ("red", "#d55e00"),
    ("green", "#009e73"),
    ("blue", "#0072b2"),
];

/// The channels of a file: MERL's three where it is called `.binary`, else the one of a CSV.
/// Standard input has no name: MERL's sizes stand first in it, and no text begins as they do.
fn channels(file: &Path) -> Result<Vec<Channel>> {
    let merl = |read: &dyn Fn(usize) -> Result<Vec<Measurement>>| {
        let channels = MERL.iter().enumerate();
        channels
            .map(|(channel, &(name, colour))| Ok((name, colour, read(channel)?)))
            .collect()
    };
    let csv = |measurements| vec![("value", "#222222", measurements)];
    if input::is_standard(file) {
        let bytes = input::bytes()?;
        let named = |error: lobes::Error| input::error_of(file, error.into());
        return if bytes.starts_with(&[90, 0, 0, 0]) {
            merl(&|channel| fit::parse_merl(&bytes, channel).map_err(named))
        } else {
            let text = String::from_utf8_lossy(&bytes);
            Ok(csv(fit::parse_csv(&text).map_err(named)?))
        };
    }
    let ending = file.extension().unwrap_or_default().to_string_lossy();
    if ending.eq_ignore_ascii_case("binary") {
        merl(&|channel| Ok(fit::read_merl(file, channel)?))
    } else {
        Ok(csv(fit::read_csv(file)?))
    }
}

fn estimate(estimate: Estimate) -> String {
    format!("{:.4} ± {:.4}", estimate.value, estimate.standard_error)
}
