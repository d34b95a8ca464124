//! Mitsuba 3's BSDFs in a scene's XML.
//!
//! Its `roughplastic` and `plastic` let light of F₀ through the boundary and back out: with the
//! default, which neglects changes of colour, the albedo of the body seen along the normal is (1 −
//! F₀) ρ, else it is (1 − F₀) ρ (1 − F)/(1 − ρF), F the mean reflectance from within. The
//! dielectric part of `principled` has F₀ = 0.08 · specular.

use roxmltree::{Document, Node};

use super::{Format, Found, Loss, Note, along_normal, contents, largest};
use crate::reflectance::{Fresnel, Material, Roughness};
use crate::{Error, Result};

/// A surface as it is put together from its plugins.
#[derive(Debug, Clone, Copy, Default)]
struct Surface {
    diffuse: [f64; 3],
    specular: [f64; 3],
    /// Of the specular part, if there is one.
    sigma: Option<f64>,
}

pub(super) fn read(text: &str, found: &mut Found) -> Result<()> {
    let document = Document::parse(text)
        .map_err(|error| contents(format!("the text is not XML ({error})")))?;
    let root = document.root_element();
    if root.tag_name().name() != "scene" && root.tag_name().name() != "bsdf" {
        return Err(contents(format!(
            "the text is not a scene of Mitsuba's: it begins with <{}>",
            root.tag_name().name()
        )));
    }
    // Those within another are its parts.
    let outermost = document.descendants().filter(|node| {
        is_bsdf(node) && !node.ancestors().skip(1).any(|ancestor| is_bsdf(&ancestor))
    });
    for bsdf in outermost {
        let name = found.name(bsdf.attribute("id").or(bsdf.attribute("name")));
        match surface(bsdf, &name, found)? {
            Ok(surface) => {
                found.add(
                    name,
                    surface.diffuse,
                    surface.specular,
                    surface.sigma.unwrap_or(0.0),
                )?;
            }
            Err(why) => found.note(&name, Loss::NotRead { why }),
        }
    }
    Ok(())
}

fn is_bsdf(node: &Node) -> bool {
    node.is_element() && node.tag_name().name() == "bsdf"
}

/// What a plugin is, or why it is not read.
fn surface(
    bsdf: Node,
    name: &str,
    found: &mut Found,
) -> Result<std::result::Result<Surface, String>> {
    let kind = bsdf.attribute("type").unwrap_or_default();
    let plugin = Plugin { bsdf, name };
    let known: &[&str];
    let surface = match kind {
        "diffuse" => {
            known = &["reflectance"];
            Surface {
                diffuse: plugin.colour("reflectance", 0.5)?,
                ..Surface::default()
            }
        }
        "conductor" | "roughconductor" => {
            known = &[
                "material",
                "eta",
                "k",
                "specular_reflectance",
                "distribution",
                "alpha",
                "alpha_u",
                "alpha_v",
                "sample_visible",
            ];
            let material = plugin.value("material");
            let normal = if material == Some("none") {
                [1.0; 3]
            } else if material.is_some()
                || plugin.value("eta").is_none()
                || plugin.value("k").is_none()
            {
                return Ok(Err(
                    "a conductor by the name of its metal; give eta and k of the three channels"
                        .to_owned(),
                ));
            } else {
                let (index, extinction) = (plugin.numbers("eta", 0.0)?, plugin.numbers("k", 0.0)?);
                found.note(name, Loss::Fresnel);
                std::array::from_fn(|channel| along_normal(index[channel], extinction[channel]))
            };
            let tint = plugin.colour("specular_reflectance", 1.0)?;
            Surface {
                specular: std::array::from_fn(|channel| normal[channel] * tint[channel]),
                sigma: Some(plugin.width(kind == "roughconductor", found)?),
                ..Surface::default()
            }
        }
        "plastic" | "roughplastic" => {
            known = &[
                "int_ior",
                "ext_ior",
                "diffuse_reflectance",
                "specular_reflectance",
                "nonlinear",
                "distribution",
                "alpha",
                "sample_visible",
            ];
            let index = plugin.index("int_ior", 1.49)? / plugin.index("ext_ior", 1.000_277)?;
            let normal = along_normal(index, 0.0);
            let nonlinear = plugin.value("nonlinear") == Some("true");
            let inside = if nonlinear { from_within(index)? } else { 0.0 };
            let body = plugin.colour("diffuse_reflectance", 0.5)?;
            found.note(name, Loss::Fresnel);
            Surface {
                diffuse: body.map(|r| (1.0 - normal) * r * (1.0 - inside) / (1.0 - r * inside)),
                specular: plugin
                    .colour("specular_reflectance", 1.0)?
                    .map(|r| r * normal),
                sigma: Some(plugin.width(kind == "roughplastic", found)?),
            }
        }
        "principled" => {
            known = &[
                "base_color",
                "metallic",
                "roughness",
                "specular",
                "anisotropic",
            ];
            let base = plugin.colour("base_color", 0.5)?;
            let metallic = plugin.unit("metallic", 0.0)?;
            let roughness = plugin.unit("roughness", 0.5)?;
            let normal = 0.08 * plugin.unit("specular", 0.5)?;
            let mut alpha = roughness * roughness;
            let anisotropic = plugin.unit("anisotropic", 0.0)?;
            if anisotropic > 0.0 {
                let aspect = (1.0 - 0.9 * anisotropic).sqrt();
                let widths = [alpha / aspect, alpha * aspect];
                found.note(name, Loss::TwoWidths { alpha: widths });
                alpha = (widths[0] * widths[1]).sqrt();
            }
            found.note(name, Loss::Fresnel);
            found.note(name, Loss::Tail { alpha });
            Surface {
                diffuse: base.map(|c| (1.0 - metallic) * c),
                specular: base.map(|c| metallic * c + (1.0 - metallic) * normal),
                sigma: Some(alpha),
            }
        }
        "twosided" | "bumpmap" | "normalmap" | "mask" => {
            if kind != "twosided" {
                let what = kind.to_owned();
                found.note(name, Loss::LeftOut { what });
            }
            let Some(inner) = plugin.parts().next() else {
                return Ok(Err(format!("{kind} of a bsdf that stands elsewhere")));
            };
            return surface(inner, name, found);
        }
        "blendbsdf" => {
            let weight = plugin.unit("weight", 0.5)?;
            let parts: Vec<Node> = plugin.parts().collect();
            let &[first, second] = parts.as_slice() else {
                return Ok(Err("a blend of others than two".to_owned()));
            };
            let (first, second) =
                match (surface(first, name, found)?, surface(second, name, found)?) {
                    (Ok(first), Ok(second)) => (first, second),
                    (Err(why), _) | (_, Err(why)) => return Ok(Err(why)),
                };
            if let (Some(a), Some(b)) = (first.sigma, second.sigma)
                && a != b
            {
                return Ok(Err("a blend of two widths".to_owned()));
            }
            let mixed = |a: [f64; 3], b: [f64; 3]| {
                std::array::from_fn(|channel| (1.0 - weight) * a[channel] + weight * b[channel])
            };
            return Ok(Ok(Surface {
                diffuse: mixed(first.diffuse, second.diffuse),
                specular: mixed(first.specular, second.specular),
                sigma: first.sigma.or(second.sigma),
            }));
        }
        _ => return Ok(Err(format!("the plugin {kind:?}"))),
    };
    for node in bsdf.children().filter(Node::is_element) {
        let key = node.attribute("name").unwrap_or_default();
        // A number that is 0 is a property that is off.
        let off = node
            .attribute("value")
            .and_then(|value| value.parse::<f64>().ok())
            == Some(0.0);
        if !known.contains(&key) && !off {
            let what = if key.is_empty() {
                node.tag_name().name()
            } else {
                key
            };
            found.note(
                name,
                Loss::LeftOut {
                    what: what.to_owned(),
                },
            );
        }
    }
    Ok(Ok(surface))
}

struct Plugin<'a, 'input, 'name> {
    bsdf: Node<'a, 'input>,
    name: &'name str,
}

impl<'a, 'input> Plugin<'a, 'input, '_> {
    fn parts(&self) -> impl Iterator<Item = Node<'a, 'input>> + use<'a, 'input> {
        self.bsdf.children().filter(is_bsdf)
    }

    fn node(&self, key: &str) -> Option<Node<'a, 'input>> {
        self.bsdf
            .children()
            .find(|node| node.is_element() && node.attribute("name") == Some(key))
    }

    fn value(&self, key: &str) -> Option<&'a str> {
        self.node(key)
            .map(|node| node.attribute("value").unwrap_or_default())
    }

    fn wrong(&self, key: &str, allowed: &str) -> Error {
        let value = self.value(key).unwrap_or_default();
        contents(format!(
            "{key} of the material {:?} is {value:?}, which is not {allowed}",
            self.name
        ))
    }

    /// Three channels: one number for all, three, or #rrggbb in sRGB.
    fn numbers(&self, key: &str, otherwise: f64) -> Result<[f64; 3]> {
        let Some(value) = self.value(key) else {
            return Ok([otherwise; 3]);
        };
        let wrong = || {
            self.wrong(
                key,
                "one number, three, or #rrggbb (textures and spectra are not read)",
            )
        };
        if let Some(hex) = value.strip_prefix('#') {
            let code = u32::from_str_radix(hex, 16)
                .ok()
                .filter(|_| hex.len() == 6)
                .ok_or_else(wrong)?;
            return Ok([16, 8, 0].map(|shift| linear(f64::from((code >> shift) & 0xff) / 255.0)));
        }
        let numbers: Vec<f64> = value
            .split(|c: char| c == ',' || c.is_whitespace())
            .filter(|word| !word.is_empty())
            .map(|word| word.parse().map_err(|_| wrong()))
            .collect::<Result<_>>()?;
        match *numbers.as_slice() {
            [one] if one.is_finite() && one >= 0.0 => Ok([one; 3]),
            [r, g, b] if [r, g, b].iter().all(|c| c.is_finite() && *c >= 0.0) => Ok([r, g, b]),
            _ => Err(wrong()),
        }
    }

    /// The same of a reflectance.
    fn colour(&self, key: &str, otherwise: f64) -> Result<[f64; 3]> {
        let colour = self.numbers(key, otherwise)?;
        if largest(colour) > 1.0 {
            return Err(self.wrong(key, "in [0, 1]"));
        }
        Ok(colour)
    }

    fn unit(&self, key: &str, otherwise: f64) -> Result<f64> {
        let [value, ..] = self.numbers(key, otherwise)?;
        if value > 1.0 {
            return Err(self.wrong(key, "in [0, 1]"));
        }
        Ok(value)
    }

    fn index(&self, key: &str, otherwise: f64) -> Result<f64> {
        match self.value(key) {
            None => Ok(otherwise),
            Some(value) => value
                .parse()
                .ok()
                .filter(|index: &f64| *index > 0.0 && index.is_finite())
                .ok_or_else(|| {
                    self.wrong(
                        key,
                        "an index of refraction above 0 (names of substances are not read)",
                    )
                }),
        }
    }

    /// σ: α of a rough surface, 0 of a smooth one.
    fn width(&self, rough: bool, found: &mut Found) -> Result<f64> {
        if !rough {
            return Ok(0.0);
        }
        let alpha = self.unit("alpha", 0.1)?;
        let widths = [self.unit("alpha_u", alpha)?, self.unit("alpha_v", alpha)?];
        let alpha = if widths[0] == widths[1] {
            widths[0]
        } else {
            found.note(self.name, Loss::TwoWidths { alpha: widths });
            (widths[0] * widths[1]).sqrt()
        };
        if self.value("distribution") == Some("ggx") {
            found.note(self.name, Loss::Tail { alpha });
        }
        Ok(alpha)
    }
}

/// sRGB's code value to linear.
fn linear(code: f64) -> f64 {
    if code <= 0.040_45 {
        code / 12.92
    } else {
        ((code + 0.055) / 1.055).powf(2.4)
    }
}

/// The mean reflectance of a boundary for light that comes from all sides within: 1 − (1 − F)/n² of
/// the mean F from outside.
fn from_within(index: f64) -> Result<f64> {
    let boundary = Fresnel::Dielectric { index };
    boundary
        .check()
        .map_err(|error| contents(error.to_string()))?;
    // ∫ 2c F(c) dc by the midpoint rule, to 10⁻⁷.
    let steps = 4000;
    let outside: f64 = (0..steps)
        .map(|k| {
            let c = (f64::from(k) + 0.5) / f64::from(steps);
            2.0 * c * boundary.reflectance(c) / f64::from(steps)
        })
        .sum();
    Ok(1.0 - (1.0 - outside) / (index * index))
}

pub(super) fn write(materials: &[Material], notes: &mut Vec<Note>) -> String {
    let mut text = String::from("<scene version=\"3.0.0\">\n");
    for material in materials {
        let (diffuse, specular) = (material.diffuse(), material.specular());
        let share = largest(specular);
        if share + largest(diffuse) > 1.0 + 1e-12 {
            notes.push(Note {
                material: material.name().to_owned(),
                loss: Loss::NotWritten {
                    format: Format::Mitsuba,
                    why: "has a largest diffuse and a largest specular channel that are together above 1",
                },
            });
            continue;
        }
        let id = format!(" id=\"{}\"", escaped(material.name()));
        if material.is_matte() {
            text += &lambert(1, &id, diffuse);
        } else if diffuse == [0.0; 3] {
            text += &mirror(1, &id, specular, material.roughness());
        } else {
            // Each part is as bright as its share of the blend lets it be.
            text += &format!(
                "  <bsdf type=\"blendbsdf\"{id}>\n    <float name=\"weight\" value=\"{share}\"/>\n"
            );
            let rest = 1.0 - share;
            text += &lambert(2, "", diffuse.map(|d| (d / rest).min(1.0)));
            text += &mirror(
                2,
                "",
                specular.map(|s| (s / share).min(1.0)),
                material.roughness(),
            );
            text += "  </bsdf>\n";
        }
    }
    text + "</scene>\n"
}

fn lambert(depth: usize, id: &str, [r, g, b]: [f64; 3]) -> String {
    let space = "  ".repeat(depth);
    format!(
        "{space}<bsdf type=\"diffuse\"{id}>\n{space}  <rgb name=\"reflectance\" value=\"{r} {g} {b}\"/>\n{space}</bsdf>\n"
    )
}

/// A mirror of facets that reflect alike at every angle.
fn mirror(depth: usize, id: &str, [r, g, b]: [f64; 3], roughness: Roughness) -> String {
    let space = "  ".repeat(depth);
    let (kind, width) = match roughness {
        Roughness::Mirror => ("conductor", String::new()),
        Roughness::Rough(sigma) => (
            "roughconductor",
            format!(
                "{space}  <string name=\"distribution\" value=\"beckmann\"/>\n{space}  <float name=\"alpha\" value=\"{sigma}\"/>\n"
            ),
        ),
    };
    format!(
        "{space}<bsdf type=\"{kind}\"{id}>\n{space}  <string name=\"material\" value=\"none\"/>\n{width}{space}  <rgb name=\"specular_reflectance\" value=\"{r} {g} {b}\"/>\n{space}</bsdf>\n"
    )
}

fn escaped(name: &str) -> String {
    name.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;")
}
