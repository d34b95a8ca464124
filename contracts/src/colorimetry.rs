//! Luminance, sRGB, chromatic adaptation and the albedos of known paints, against colour-science.

use lobes::glam::DVec3;
use serde::Deserialize;

use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::features::{Continuation, ImageSpectrum, PaperFeatures};
use lobes::files::{linear_of_srgb, srgb_of_linear};
use lobes::illumination::{ChromaticAdaptation, Luminance, builtin};
use lobes::reflectance::{Material, Variant};
use lobes::reflection::{Camera, Renderer, Settings};
use lobes::{Error, Parallelism, Result};

const ORACLE: Oracle = Oracle::Snapshot("colorimetry");

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "colorimetry/luminance",
            function: "illumination::Luminance::weights",
            oracle: ORACLE,
            domain: "BT.709's own row, and the row of Radiance's primaries and white",
            metric: Metric::Absolute,
            bound: 3e-9,
            why: "Radiance's row is written with nine digits; BT.709's four are the standard's own, and exact",
            loose: None,
            measure: luminance,
        },
        Contract {
            id: "colorimetry/luminance-of-primaries",
            function: "illumination::Luminance::weights",
            oracle: ORACLE,
            domain: "BT.709's row against the one that its primaries and D65 give",
            metric: Metric::Absolute,
            bound: 5e-5,
            why: "the standard rounds its row to four digits",
            loose: None,
            measure: luminance_of_primaries,
        },
        Contract {
            id: "colorimetry/srgb-decode",
            function: "files::linear_of_srgb",
            oracle: ORACLE,
            domain: "every 8-bit code, and 300 codes of 16 bits",
            metric: Metric::Absolute,
            bound: 4e-16,
            why: "a power near 1, off by an ε or two",
            loose: None,
            measure: srgb_decode,
        },
        Contract {
            id: "colorimetry/srgb-encode",
            function: "files::srgb_of_linear",
            oracle: ORACLE,
            domain: "263 linear values: at random on [0, 1], about the knee, its ends and the knee itself",
            metric: Metric::Absolute,
            bound: 6e-16,
            why: "a power near 1, off by an ε or two",
            loose: None,
            measure: srgb_encode,
        },
        Contract {
            id: "colorimetry/adaptation",
            function: "illumination::ChromaticAdaptation::apply",
            oracle: ORACLE,
            domain: "32 random colours under each of four pairs of whites",
            metric: Metric::Absolute,
            bound: 4e-15,
            why: "three products of matrices of three rows and one inverse, well conditioned",
            loose: None,
            measure: adaptation,
        },
        Contract {
            id: "colorimetry/paint",
            function: "reflection::Renderer::render, features::PaperFeatures::of_image",
            oracle: ORACLE,
            domain: "spheres of 23 ColorChecker patches and 14 of Munsell's colours, seen beside a white one in built-in light",
            metric: Metric::Relative,
            bound: 4e-15,
            why: "a matte pixel is its albedo times a white one, whatever the light and however well it is integrated: rounding alone",
            loose: None,
            measure: paint,
        },
    ]
}

#[derive(Deserialize)]
struct Codes {
    codes: Vec<f64>,
    depth: i32,
    linear: Vec<f64>,
}

fn srgb_decode(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Codes>("colorimetry", "srgb-decode")? {
        let top = 2f64.powi(case.depth) - 1.0;
        for (code, want) in case.codes.iter().zip(case.linear) {
            tally.compare(linear_of_srgb(code / top), want, || {
                format!("code {code} of {} bits", case.depth)
            });
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Encoded {
    linear: Vec<f64>,
    encoded: Vec<f64>,
}

fn srgb_encode(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Encoded>("colorimetry", "srgb-encode")? {
        for (linear, want) in case.linear.iter().zip(case.encoded) {
            tally.compare(srgb_of_linear(*linear), want, || format!("{linear}"));
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Adapted {
    source: [f64; 3],
    target: [f64; 3],
    colours: Vec<[f64; 3]>,
    adapted: Vec<[f64; 3]>,
}

fn adaptation(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Adapted>("colorimetry", "adaptation")? {
        let adaptation = ChromaticAdaptation::new(case.source, case.target)?;
        for (colour, want) in case.colours.iter().zip(case.adapted) {
            for (got, want) in adaptation.apply(*colour).into_iter().zip(want) {
                tally.compare(got, want, || {
                    format!("{colour:?} from {:?} to {:?}", case.source, case.target)
                });
            }
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Paints {
    patches: Vec<String>,
    albedos: Vec<[f64; 3]>,
}

fn paint(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    let settings = Settings {
        size: 32,
        ..Settings::default()
    };
    let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
    let spectrum = ImageSpectrum::new(44, Continuation::Mirror)?;
    let maps = builtin()?;
    let mut maps = maps.iter().cycle();
    for name in ["colorchecker", "munsell"] {
        for case in snapshots.cases::<Paints>("colorimetry", name)? {
            let Some(map) = maps.next() else { continue };
            let renderer = Renderer::new(map, Parallelism::Rayon)?;
            let colour = |material: &Material| -> Result<[f64; 3]> {
                let rendering = renderer.render(
                    material,
                    Variant::Ward1992,
                    &camera,
                    &settings,
                    Parallelism::Rayon,
                )?;
                Ok(PaperFeatures::of_image(&spectrum, &rendering.image)?.colour)
            };
            let white = colour(&Material::white())?;
            for (patch, albedo) in case.patches.iter().zip(case.albedos) {
                let seen = colour(&Material::from_albedos(patch, albedo, [0.0; 3], 0.0)?)?;
                for channel in 0..3 {
                    let got = (seen[channel] / white[channel]).sqrt();
                    tally.compare(got, albedo[channel], || {
                        format!("{patch} under {}", map.name())
                    });
                }
            }
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Row {
    weights: String,
    row: [f64; 3],
}

fn luminance(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    rows(snapshots, "luminance", tally)
}

fn luminance_of_primaries(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    rows(snapshots, "luminance-of-primaries", tally)
}

fn rows(snapshots: &Snapshots, name: &str, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Row>("colorimetry", name)? {
        let weights = match case.weights.as_str() {
            "rec709" => Luminance::Rec709,
            "radiance" => Luminance::Radiance,
            other => {
                return Err(Error::UnknownName {
                    what: "set of luminance weights",
                    name: other.into(),
                    names: vec!["rec709".into(), "radiance".into()],
                });
            }
        };
        for (channel, (got, want)) in weights.weights().iter().zip(case.row).enumerate() {
            tally.compare(*got, want, || {
                format!("{}, {}", case.weights, ["red", "green", "blue"][channel])
            });
        }
    }
    Ok(())
}
