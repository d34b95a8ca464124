//! Radiance's pictures, against Radiance's own programs.

use serde::Deserialize;

use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::files;
use lobes::{Error, Result};

const ORACLE: Oracle = Oracle::Snapshot("picture");

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "picture/rgbe",
            function: "files::read",
            oracle: ORACLE,
            domain: "an 8×5 picture of every kind of exponent in all eight orientations, new runs, old runs",
            metric: Metric::Mismatch,
            bound: 0.0,
            why: "a mantissa, its half step and a power of two are exact",
            loose: None,
            measure: rgbe,
        },
        Contract {
            id: "picture/exposure",
            function: "files::read",
            oracle: ORACLE,
            domain: "the same picture with two exposures and a colour correction in its header",
            metric: Metric::Relative,
            bound: 2e-7,
            why: "Radiance divides in single precision",
            loose: None,
            measure: exposure,
        },
        Contract {
            id: "picture/xyze",
            function: "files::read",
            oracle: ORACLE,
            domain: "three colours in XYZE",
            metric: Metric::Scaled("the pixel's largest channel"),
            bound: 1.0 / 128.0,
            why: "ra_xyze answers in RGBE, whose mantissas have 128 to 256 steps to the largest channel",
            loose: None,
            measure: xyze,
        },
    ]
}

#[derive(Deserialize)]
struct PictureCase {
    what: Option<String>,
    file: String,
    pixels: Vec<Vec<[f64; 3]>>,
}

fn each(
    snapshots: &Snapshots,
    name: &str,
    wanted: impl Fn(&str) -> bool,
    mut compare: impl FnMut([f64; 3], [f64; 3], &str),
) -> Result<()> {
    for case in snapshots.cases::<PictureCase>("picture", name)? {
        let what = case.what.as_deref().unwrap_or(name);
        if !wanted(what) {
            continue;
        }
        let bytes: Option<Vec<u8>> = (0..case.file.len())
            .step_by(2)
            .map(|i| u8::from_str_radix(case.file.get(i..i + 2)?, 16).ok())
            .collect();
        let bytes = bytes.ok_or_else(|| Error::Contents {
            problem: format!("{what} is not in hex"),
            remedy: "make the snapshot again".into(),
        })?;
        let picture = files::decode(&bytes).map_err(|error| Error::Contents {
            problem: format!("{what}: {error}"),
            remedy: "make the snapshot again".into(),
        })?;
        lobes::check_length("the picture", case.pixels.len(), picture.height)?;
        let want = case.pixels.concat();
        lobes::check_length("the picture", want.len(), picture.pixels.len())?;
        for (i, (got, want)) in picture.pixels.iter().zip(want).enumerate() {
            compare(*got, want, &format!("{what}, pixel {i}"));
        }
    }
    Ok(())
}

fn rgbe(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    each(
        snapshots,
        "picture",
        |what| what != "exposure",
        |got, want, at| tally.same(&got, &want, || at.to_owned()),
    )
}

fn exposure(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    each(
        snapshots,
        "picture",
        |what| what == "exposure",
        |got, want, at| {
            for (got, want) in got.iter().zip(want) {
                // Below this, single precision runs out of digits.
                if want == 0.0 || want > 1e-37 {
                    tally.compare(*got, want, || at.to_owned());
                }
            }
        },
    )
}

fn xyze(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    each(
        snapshots,
        "picture-xyze",
        |_| true,
        |got, want, at| {
            let scale = want.iter().copied().fold(0.0, f64::max);
            for (got, want) in got.iter().zip(want) {
                tally.compare_scaled(*got, want, scale, || at.to_owned());
            }
        },
    )
}
