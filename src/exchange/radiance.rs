//! Radiance's primitives.
//!
//! `modifier type identifier`, then three lists, of words, of whole numbers and of numbers, each
//! after its length; `#` begins a comment. Ward Larson and Shakespeare 1998, *Rendering with
//! Radiance*; `plastic` and `metal` have the numbers R G B, specularity, roughness.

use super::{Format, Found, Loss, Note, contents, largest};
use crate::reflectance::Material;
use crate::{Error, Result};

/// The types that are materials, by which others in a scene are told from them.
const OTHER_MATERIALS: [&str; 27] = [
    "light",
    "illum",
    "glow",
    "spotlight",
    "mirror",
    "prism1",
    "prism2",
    "mist",
    "trans",
    "plastic2",
    "metal2",
    "trans2",
    "dielectric",
    "interface",
    "glass",
    "plasfunc",
    "metfunc",
    "transfunc",
    "BRTDfunc",
    "plasdata",
    "metdata",
    "transdata",
    "antimatter",
    "BSDF",
    "aBSDF",
    "ashik2",
    "WGMDfunc",
];

pub(super) fn read(text: &str, found: &mut Found) -> Result<()> {
    let mut words = text.lines().flat_map(|line| {
        line.split('#')
            .next()
            .unwrap_or_default()
            .split_whitespace()
    });
    while let Some(modifier) = words.next() {
        if modifier.starts_with('!') {
            return Err(contents(format!(
                "the command {modifier:?} stands where a primitive should; only primitives are read"
            )));
        }
        let (Some(kind), Some(identifier)) = (words.next(), words.next()) else {
            return Err(contents(format!(
                "the text ends within the primitive that {modifier:?} begins"
            )));
        };
        if kind == "alias" {
            // An alias has one word more and no lists.
            words.next();
            continue;
        }
        let mut list = |what: &str| -> Result<Vec<&str>> {
            let cut = || contents(format!("the {what} of {identifier:?} are cut off"));
            let count: usize = words.next().ok_or_else(cut)?.parse().map_err(|_| {
                contents(format!(
                    "before the {what} of {identifier:?} stands no count"
                ))
            })?;
            let mut list = Vec::new();
            for _ in 0..count {
                list.push(words.next().ok_or_else(cut)?);
            }
            Ok(list)
        };
        list("words")?;
        list("whole numbers")?;
        let numbers = list("numbers")?;
        if kind != "plastic" && kind != "metal" {
            if OTHER_MATERIALS.contains(&kind) {
                let why = format!("Radiance's {kind}, where plastic and metal are read");
                found.note(identifier, Loss::NotRead { why });
            }
            continue;
        }
        let numbers: Vec<f64> = numbers
            .into_iter()
            .map(|word| {
                word.parse()
                    .map_err(|_| contents(format!("{word:?} of {identifier:?} is not a number")))
            })
            .collect::<Result<_>>()?;
        let &[red, green, blue, specularity, sigma] = numbers.as_slice() else {
            return Err(contents(format!(
                "{identifier:?} has {} numbers where {kind} has 5",
                numbers.len()
            )));
        };
        let name = found.name(Some(identifier));
        if modifier != "void" {
            let what = format!("modifier {modifier:?}");
            found.note(&name, Loss::LeftOut { what });
        }
        let make = if kind == "plastic" {
            Material::plastic
        } else {
            Material::metal
        };
        found.materials.push(
            make(name, [red, green, blue], specularity, sigma)
                .map_err(|error| contents(format!("{kind} {identifier:?}: {error}")))?,
        );
    }
    Ok(())
}

pub(super) fn write(materials: &[Material], notes: &mut Vec<Note>) -> Result<String> {
    let mut text = String::from("# R G B specularity roughness\n");
    let mut written: Vec<String> = Vec::new();
    for material in materials {
        let mut note = |loss| {
            notes.push(Note {
                material: material.name().to_owned(),
                loss,
            });
        };
        let Some((kind, reflectance, specularity)) = arguments(material) else {
            note(Loss::NotWritten {
                format: Format::Radiance,
                why: "has a highlight that is neither white nor of its body's colour",
            });
            continue;
        };
        let name: String = material
            .name()
            .chars()
            .map(|c| {
                if c.is_whitespace() || c == '#' {
                    '_'
                } else {
                    c
                }
            })
            .collect();
        if written.contains(&name) {
            return Err(Error::SameName {
                format: "radiance",
                name,
            });
        }
        if name != material.name() {
            note(Loss::Renamed { name: name.clone() });
        }
        let [red, green, blue] = reflectance;
        let sigma = material.roughness().sigma();
        text +=
            &format!("\nvoid {kind} {name}\n0\n0\n5 {red} {green} {blue} {specularity} {sigma}\n");
        written.push(name);
    }
    Ok(text)
}

/// Type, R and S of which `ρ_d` and `ρ_s` are those of a material, if any are.
fn arguments(material: &Material) -> Option<(&'static str, [f64; 3], f64)> {
    let (diffuse, specular) = (material.diffuse(), material.specular());
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * a.abs().max(b.abs());
    let white = specular[0];
    if specular.iter().all(|&s| close(s, white)) && white < 1.0 {
        let reflectance = diffuse.map(|d| d / (1.0 - white));
        return (largest(reflectance) <= 1.0 + 1e-12)
            .then(|| ("plastic", reflectance.map(|r| r.min(1.0)), white));
    }
    // ρ_d = R (1 − S) and ρ_s = R S.
    let sum = material.gain();
    let share = largest(specular) / {
        let brightest = (0..3).max_by(|&a, &b| specular[a].total_cmp(&specular[b]))?;
        sum[brightest]
    };
    let fits = (0..3).all(|channel| close(specular[channel], share * sum[channel]));
    (fits && largest(sum) <= 1.0 + 1e-12).then(|| ("metal", sum.map(|r| r.min(1.0)), share))
}
