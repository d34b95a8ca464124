//! How often the 90 % intervals of light that was read off a ball hold the truth, where the
//! reflectance is read off the picture too, and where it is told.
//!
//! ```text
//! cargo run --release -p lobes-experiments --example light_coverage -- --whole [--balls 6]
//! ```
//!
//! Pictures of 8 bits of balls of random reflectances under the five built-in maps that the model of
//! finishes has not learned from, cut off nowhere and exposed as a camera does. Without `--whole`
//! one ball of each finish under one map.

use std::time::Instant;

use lobes::illumination::builtin;
use lobes::inference::FinishModel;
use lobes::{Parallelism, Result};
use lobes_experiments::{
    LightLikeness, LightShots, ReflectanceKnowledge, learned_and_judged, light_coverage,
};

const KNOWLEDGES: [(&str, ReflectanceKnowledge); 3] = [
    ("read", ReflectanceKnowledge::Averaged),
    ("likeliest", ReflectanceKnowledge::Likeliest),
    ("told", ReflectanceKnowledge::Told),
];

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let whole = arguments.iter().any(|argument| argument == "--whole");
    let balls = arguments
        .iter()
        .position(|argument| argument == "--balls")
        .and_then(|at| arguments.get(at + 1)?.parse().ok())
        .unwrap_or(if whole { 6 } else { 1 });
    let (_, mut maps) = learned_and_judged(builtin()?);
    if !whole {
        maps.truncate(1);
    }
    let model = FinishModel::builtin()?;
    for unclipped in [true, false] {
        let start = Instant::now();
        let shots = LightShots {
            balls,
            seed: 5,
            unclipped,
        };
        let all = light_coverage(&model, &maps, shots, Parallelism::Rayon, &|| ())?;
        println!(
            "{}: {} maps, {balls} balls of each finish, {:.0} s",
            if unclipped {
                "cut off nowhere"
            } else {
                "a camera's exposure"
            },
            maps.len(),
            start.elapsed().as_secs_f64()
        );
        println!(
            "| finish | reflectance | radiance held | irradiance held | irradiance off, half width | likeness, least |"
        );
        println!("| --- | --- | ---: | ---: | ---: | ---: |");
        for of in &all {
            for (name, known) in KNOWLEDGES {
                let mut line = format!("| {} | {name} |", of.finish.name());
                for quantity in 0..2 {
                    let shares = of.by_map.iter();
                    let shares = shares.map(|map| map[quantity][known as usize].share());
                    let (low, high) = shares.fold((1.0, 0.0), |(low, high), share| {
                        (f64::min(low, share), f64::max(high, share))
                    });
                    line += &format!(
                        " {:.0} % ({:.0} – {:.0}) |",
                        100.0 * of.held(quantity, known).share(),
                        100.0 * low,
                        100.0 * high
                    );
                }
                let sorted = |which: fn(&LightLikeness) -> f64| {
                    let balls = of.balls.iter();
                    let mut values: Vec<f64> =
                        balls.map(|ball| which(&ball[known as usize])).collect();
                    values.sort_by(f64::total_cmp);
                    values
                };
                let median =
                    |values: &[f64]| values.get(values.len() / 2).copied().unwrap_or(f64::NAN);
                let likeness = sorted(|like| like.correlation);
                line += &format!(
                    " {:.1} %, {:.1} % | {:.2}, {:.2} |",
                    100.0 * median(&sorted(|like| like.irradiance_error)),
                    100.0 * median(&sorted(|like| like.irradiance_width)),
                    median(&likeness),
                    likeness.first().copied().unwrap_or(f64::NAN)
                );
                println!("{line}");
            }
        }
    }
    Ok(())
}
