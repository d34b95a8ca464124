//! `lobes list`: the names that other verbs take.

use comfy_table::{CellAlignment, Table, presets};
use serde_json::json;

use crate::arguments::{List, Listed};
use crate::error::Result;
use crate::{console, materials};
use lobes::exchange;
use lobes::illumination::{EnvironmentMap, Luminance, builtin};
use lobes::reflectance::Variant;

pub(super) fn run(options: &List) -> Result<()> {
    match options.what {
        Listed::Lights => lights(&builtin()?),
        Listed::Materials => list_materials(options),
        Listed::Lobes => lobes(),
    }
}

fn lights(maps: &[EnvironmentMap]) -> Result<()> {
    let mut table = table(&["light", "pixels", "mean luminance", "brightest"]);
    for map in maps {
        let mean = Luminance::Rec709.of(map.mean());
        let brightest = map
            .luminance(Luminance::Rec709)
            .into_iter()
            .fold(0.0, f64::max);
        table.add_row([
            map.name().to_owned(),
            format!("{} × {}", map.width(), map.height()),
            format!("{mean:.3}"),
            format!("{brightest:.1}"),
        ]);
        console::json(&json!({
            "light": map.name(),
            "width": map.width(),
            "height": map.height(),
            "mean_luminance": mean,
            "brightest": brightest,
        }))?;
    }
    say(table, 1);
    Ok(())
}

fn list_materials(options: &List) -> Result<()> {
    if let Some(format) = options.written_as {
        let written = exchange::write(format, &materials::load(&options.materials)?)?;
        for note in &written.notes {
            console::complain(note.to_string());
        }
        console::bytes(written.text.as_bytes());
        return Ok(());
    }
    let mut table = table(&[
        "material", "σ", "ρd red", "green", "blue", "ρs red", "green", "blue",
    ]);
    for material in materials::load(&options.materials)? {
        let (diffuse, specular) = (material.diffuse(), material.specular());
        let sigma = material.roughness().sigma();
        let mut row = vec![material.name().to_owned(), format!("{sigma}")];
        row.extend(
            diffuse
                .iter()
                .chain(&specular)
                .map(|value| format!("{value:.4}")),
        );
        table.add_row(row);
        console::json(&json!({
            "material": material.name(),
            "diffuse": diffuse,
            "specular": specular,
            "sigma": sigma,
        }))?;
    }
    say(table, 1);
    Ok(())
}

fn lobes() -> Result<()> {
    let mut table = table(&["lobe", "what it is"]);
    for variant in Variant::ALL {
        let what = variant.description();
        let default = variant == Variant::default();
        let mark = if default { " (the default)" } else { "" };
        table.add_row([variant.name().to_owned(), format!("{what}{mark}")]);
        console::json(&json!({ "lobe": variant.name(), "what": what, "default": default }))?;
    }
    say(table, 2);
    Ok(())
}

fn table(headings: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(headings);
    table
}

/// Says a table whose columns from one on are numbers.
fn say(mut table: Table, numbers: usize) {
    for column in table.column_iter_mut().skip(numbers) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    console::answer(table.to_string());
}
