//! glTF 2.0's metallic-roughness materials.
//!
//! Appendix B of the specification: a dielectric of F₀ = 0.04 over a Lambert body of the base
//! colour, and a metal of F₀ = base colour, mixed by `metallic`; both GGX of α = roughness².
//! `KHR_materials_ior` gives the dielectric another F₀, ((n − 1)/(n + 1))², and
//! `KHR_materials_specular` multiplies it: by a colour, up to 1, and then by a factor.

use serde_json::{Map, Value, json};

use super::{Format, Found, Loss, Note, along_normal, contents, largest};
use crate::Result;
use crate::reflectance::Material;

/// F₀ of an index of 1.5.
const DIELECTRIC: f64 = 0.04;

/// Properties that a [`Material`] has no place for, beside textures.
const LEFT_OUT: [(&str, &str); 3] = [
    ("normalTexture", "normalTexture"),
    ("occlusionTexture", "occlusionTexture"),
    ("emissiveTexture", "emissiveTexture"),
];

pub(super) fn read(text: &str, found: &mut Found) -> Result<()> {
    let file: Value = serde_json::from_str(text)
        .map_err(|error| contents(format!("the text is not JSON ({error})")))?;
    let version = file.pointer("/asset/version").and_then(Value::as_str);
    if version.is_none_or(|version| !version.starts_with("2.")) {
        return Err(contents(
            "the text is not glTF 2: its asset has no version 2.x".to_owned(),
        ));
    }
    let materials = match file.get("materials") {
        None => return Ok(()),
        Some(list) => list
            .as_array()
            .ok_or_else(|| contents("its materials are not a list".to_owned()))?,
    };
    for material in materials {
        read_one(material, found)?;
    }
    Ok(())
}

fn read_one(material: &Value, found: &mut Found) -> Result<()> {
    let name = found.name(material.get("name").and_then(Value::as_str));
    let empty = Value::Object(Map::new());
    let rough = material.get("pbrMetallicRoughness").unwrap_or(&empty);
    let number = |of: &Value, key: &str, otherwise: f64, most: f64| -> Result<f64> {
        match of.get(key) {
            None => Ok(otherwise),
            Some(value) => value
                .as_f64()
                .filter(|value| (0.0..=most).contains(value))
                .ok_or_else(|| {
                    contents(format!(
                        "{key} of the material {name:?} is {value}, which is not a number in [0, {most}]"
                    ))
                }),
        }
    };
    let colour = |of: &Value, key: &str, most: f64| -> Result<[f64; 3]> {
        let Some(value) = of.get(key) else {
            return Ok([1.0; 3]);
        };
        let channels: Option<Vec<f64>> = value
            .as_array()
            .and_then(|list| list.iter().map(Value::as_f64).collect());
        match channels.as_deref() {
            Some(&[r, g, b] | &[r, g, b, _])
                if [r, g, b].iter().all(|c| (0.0..=most).contains(c)) =>
            {
                Ok([r, g, b])
            }
            _ => Err(contents(format!(
                "{key} of the material {name:?} is {value}, which is not three numbers in [0, {most}]"
            ))),
        }
    };
    let base = colour(rough, "baseColorFactor", 1.0)?;
    let metallic = number(rough, "metallicFactor", 1.0, 1.0)?;
    let roughness = number(rough, "roughnessFactor", 1.0, 1.0)?;
    let extension = |key: &str| material.get("extensions").and_then(|all| all.get(key));
    let mut normal = [DIELECTRIC; 3];
    let mut factor = 1.0;
    if let Some(ior) = extension("KHR_materials_ior") {
        let index = number(ior, "ior", 1.5, f64::MAX)?;
        // 0 stands for a reflectance of 1 at every angle.
        normal = [if index == 0.0 {
            1.0
        } else {
            along_normal(index, 0.0)
        }; 3];
    }
    if let Some(specular) = extension("KHR_materials_specular") {
        let tint = colour(specular, "specularColorFactor", f64::MAX)?;
        factor = number(specular, "specularFactor", 1.0, 1.0)?;
        normal = std::array::from_fn(|channel| (normal[channel] * tint[channel]).min(1.0));
    }
    let normal = normal.map(|f| f * factor);
    let body = (1.0 - metallic) * (1.0 - largest(normal));
    let diffuse = base.map(|c| body * c);
    let specular = std::array::from_fn(|channel| {
        (1.0 - metallic) * normal[channel] + metallic * base[channel]
    });
    let mut leave_out = |what: &str| {
        found.note(
            &name,
            Loss::LeftOut {
                what: what.to_owned(),
            },
        );
    };
    for texture in ["baseColorTexture", "metallicRoughnessTexture"] {
        if rough.get(texture).is_some() {
            leave_out(texture);
        }
    }
    for (key, what) in LEFT_OUT {
        if material.get(key).is_some() {
            leave_out(what);
        }
    }
    if material.get("emissiveFactor").is_some()
        && colour(material, "emissiveFactor", f64::MAX)? != [0.0; 3]
    {
        leave_out("emissiveFactor");
    }
    if material
        .get("alphaMode")
        .is_some_and(|mode| mode != "OPAQUE")
    {
        leave_out("alphaMode");
    }
    if let Some(extensions) = material.get("extensions").and_then(Value::as_object) {
        for key in extensions.keys() {
            if key != "KHR_materials_ior" && key != "KHR_materials_specular" {
                leave_out(key);
            }
        }
    }
    if let Some(specular) = extension("KHR_materials_specular") {
        for texture in ["specularTexture", "specularColorTexture"] {
            if specular.get(texture).is_some() {
                leave_out(texture);
            }
        }
    }
    let alpha = roughness * roughness;
    if specular != [0.0; 3] {
        if specular != [1.0; 3] {
            found.note(&name, Loss::Fresnel);
        }
        if alpha > 0.0 {
            found.note(&name, Loss::Tail { alpha });
        }
    }
    found.add(name, diffuse, specular, alpha)
}

pub(super) fn write(materials: &[Material], notes: &mut Vec<Note>) -> String {
    let mut list = Vec::new();
    let mut extended = false;
    for material in materials {
        let (diffuse, specular) = (material.diffuse(), material.specular());
        let mut note = |loss| {
            notes.push(Note {
                material: material.name().to_owned(),
                loss,
            });
        };
        let sigma = material.roughness().sigma();
        let top = largest(specular);
        let matte = material.is_matte();
        // A metal if nothing is diffuse, else a dielectric whose reflectance the extension sets.
        let metal = !matte && diffuse == [0.0; 3];
        let base = if metal {
            specular
        } else if top < 1.0 {
            diffuse.map(|d| d / (1.0 - top))
        } else {
            [f64::INFINITY; 3]
        };
        if largest(base) > 1.0 + 1e-12 {
            note(Loss::NotWritten {
                format: Format::Gltf,
                why: "has more diffuse reflectance than a body under so bright a highlight has in it",
            });
            continue;
        }
        if !matte {
            if specular != [1.0; 3] {
                note(Loss::FresnelAdded);
            }
            if sigma > 0.0 {
                note(Loss::NoTail { sigma });
            }
        }
        let [r, g, b] = base.map(|c| c.min(1.0));
        let mut entry = json!({
            "name": material.name(),
            "pbrMetallicRoughness": {
                "baseColorFactor": [r, g, b, 1.0],
                "metallicFactor": if metal { 1.0 } else { 0.0 },
                // A matte surface has no highlight whose roughness would count.
                "roughnessFactor": if matte { 1.0 } else { sigma.sqrt() },
            },
        });
        if !metal {
            extended = true;
            entry["extensions"] = json!({
                "KHR_materials_specular": if matte {
                    json!({ "specularFactor": 0.0 })
                } else {
                    json!({ "specularColorFactor": specular.map(|s| s / DIELECTRIC) })
                },
            });
        }
        list.push(entry);
    }
    let mut file = json!({
        "asset": { "version": "2.0", "generator": "lobes" },
        "materials": list,
    });
    if extended {
        file["extensionsUsed"] = json!(["KHR_materials_specular"]);
    }
    // A value made of numbers, strings and lists has a text.
    format!("{file:#}\n")
}
