//! What is said of a ball: a sentence, and a line of JSON.

use serde_json::json;

use super::ball::Ball;
use super::{Answer, Entry};
use crate::input;
use lobes::features::Seen;
use lobes::inference::{FinishVerdict, Verdict};
use lobes::picture::Circle;
use lobes::reflectance::{Finish, Material};

pub(super) const NONE_OF_THESE: &str = "none of these";
pub(super) const NO_SINGLE_FINISH: &str = "no single finish";

/// Whether the pictures of two materials differ by their exposure only: one finish, and albedos
/// that are the same multiple of the other's.
fn same_but_for_exposure(a: &Material, b: &Material) -> bool {
    let albedos = |m: &Material| -> Vec<f64> { [m.diffuse(), m.specular()].concat() };
    let (p, q) = (albedos(a), albedos(b));
    let (sum_p, sum_q) = (p.iter().sum::<f64>(), q.iter().sum::<f64>());
    let mut pairs = p.iter().zip(&q);
    pairs.all(|(x, y)| (x * sum_q - y * sum_p).abs() <= 1e-9 * sum_p * sum_q)
        && (a.is_matte() || a.roughness() == b.roughness())
}

/// The probability with which intervals hold the truth.
pub(super) const LEVEL: f64 = 0.9;

/// Low end, median and high end of a 90 % interval.
fn interval(quantile: impl Fn(f64) -> f64) -> [f64; 3] {
    [0.05, 0.5, 0.95].map(quantile)
}

/// The likeliest answers with their probabilities, those of a hundredth and more, the likeliest
/// first.
fn ranked<'a>(answers: impl IntoIterator<Item = (f64, &'a str)>) -> Vec<(f64, &'a str)> {
    let mut answers: Vec<(f64, &str)> = answers.into_iter().collect();
    answers.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut place = 0;
    answers.retain(|(p, _)| {
        place += 1;
        place == 1 || *p >= 0.01
    });
    answers
}

fn listed(answers: &[(f64, &str)]) -> String {
    let all = answers.iter().map(|(p, name)| format!("{name} {p:.2}"));
    all.collect::<Vec<_>>().join(", ")
}

pub(super) fn finishes(verdict: &FinishVerdict) -> Vec<(f64, &'static str)> {
    let of = verdict
        .finishes
        .into_iter()
        .zip(Finish::ALL.map(Finish::name));
    ranked(of.chain([(verdict.none, NO_SINGLE_FINISH)]))
}

pub(super) fn names<'a>(verdict: &Verdict, materials: &'a [Material]) -> Vec<(f64, &'a str)> {
    let of = verdict
        .probabilities
        .iter()
        .copied()
        .zip(materials.iter().map(Material::name));
    let mut all = ranked(of);
    all.truncate(3);
    ranked(all.into_iter().chain([(verdict.none, NONE_OF_THESE)]))
}

/// σ in words.
fn roughness(verdict: &FinishVerdict) -> String {
    match verdict.sigma.below() {
        Some(end) => format!("σ below {end}"),
        None => {
            let [low, middle, high] = verdict.sigma.interval(LEVEL);
            format!("σ {middle:.3} (90 %: {low:.3} – {high:.3})")
        }
    }
}

pub(super) fn sentence(ball: &Ball, answer: &Answer, materials: &[Material], all: bool) -> String {
    let finish = &answer.finish;
    let mut text = listed(&finishes(finish));
    match finish.finish() {
        // Of what is not understood nothing is measured.
        None => text.push_str(
            "; glass, something round that is no ball, a picture of one, or a pattern that hides the finish: no other number is given",
        ),
        Some(likeliest) => {
            if likeliest != Finish::Matte {
                text.push_str(&format!("; {}", roughness(finish)));
                let [low, middle, high] = finish.share.interval(LEVEL);
                text.push_str(&format!(
                    ", specular share {middle:.2} (90 %: {low:.2} – {high:.2})"
                ));
            }
            let [r, g, b] = finish.base_colour();
            text.push_str(&format!("; base colour {r:.2} {g:.2} {b:.2} in white light"));
        }
    }
    if let Some(verdict) = &answer.name {
        text.push_str(&format!("; named {}", listed(&names(verdict, materials))));
        let mut order: Vec<usize> = (0..materials.len()).collect();
        order.sort_by(|&a, &b| verdict.probabilities[b].total_cmp(&verdict.probabilities[a]));
        if let [first, second, ..] = order[..]
            && verdict.probabilities[second] >= 0.01
            && same_but_for_exposure(&materials[first], &materials[second])
        {
            text.push_str(&format!(
                "; {} and {} cannot be told apart without a reference in the picture, for they differ in brightness only",
                materials[first].name(),
                materials[second].name()
            ));
        }
        if ball.grey {
            text.push_str("; a grey picture, named without colour");
        }
    }
    if ball.saturated > 0.0 {
        text.push_str(&format!("; {:.1} % saturated", 100.0 * ball.saturated));
    }
    let prints = ball.seen_where.share(Seen::Print);
    if prints >= 0.01 {
        text.push_str(&format!(
            "; {:.0} % of the ball is usable, for {:.0} % is covered by a print, a seam, a hole or something before it",
            100.0 * ball.seen_where.usable(),
            100.0 * prints
        ));
    }
    if ball.seen < 0.995 {
        text.push_str(&format!(
            "; {:.0} % of the ball lies beyond the border of the picture",
            100.0 * (1.0 - ball.seen)
        ));
    }
    if let Some(found) = ball.elongation {
        text.push_str(&format!(
            "; the outline is {:.0} % longer than wide, so the picture was squashed or this is no ball: what is read of it is not to be trusted",
            100.0 * (found.ratio - 1.0)
        ));
    }
    if let Some((coverage, left_out)) = ball.shape {
        text.push_str(&format!(
            "; the shape shows {:.0} % of the normals that a ball does, and {:.1} % of its pixels, far darker than others of the same normal, are left out as shadow; what it mirrors of itself is not known of",
            100.0 * coverage,
            100.0 * left_out
        ));
    }
    if ball.gain_map {
        text.push_str("; the gain map is left aside, and the picture is read as it is without");
    }
    if ball.found {
        let Circle { x, y, radius } = ball.circle;
        text.push_str(&format!("; ball found at {x:.1},{y:.1},{radius:.1}"));
    }
    if !all && !ball.others.is_empty() {
        let others = ball.others.iter();
        let circles: Vec<String> = others
            .map(|c| format!("{:.1},{:.1},{:.1}", c.x, c.y, c.radius))
            .collect();
        text.push_str(&format!(
            "; more in the picture looks like a ball, which --circle chooses and --all reads: {}",
            circles.join(" and ")
        ));
    }
    text
}

pub(super) fn line_of_json(
    entry: &Entry,
    ball: &Ball,
    answer: &Answer,
    materials: &[Material],
) -> serde_json::Value {
    let numbers =
        |[low, median, high]: [f64; 3]| json!({ "low": low, "median": median, "high": high });
    let circle = |circle: &Circle| json!([circle.x, circle.y, circle.radius]);
    let finish = &answer.finish;
    let finishes: serde_json::Map<String, serde_json::Value> = Finish::ALL
        .iter()
        .zip(finish.finishes)
        .map(|(finish, p)| (finish.name().to_owned(), json!(p)))
        .collect();
    let ends = finish.base_colour_interval();
    let names = answer.name.as_ref().map(|verdict| {
        let probabilities: serde_json::Map<String, serde_json::Value> = materials
            .iter()
            .zip(&verdict.probabilities)
            .map(|(material, p)| (material.name().to_owned(), json!(p)))
            .collect();
        let (share, sigma) = verdict.posterior.mode();
        json!({
            "material": verdict.material().map(|i| materials[i].name()),
            "probabilities": probabilities,
            "none": verdict.none,
            "sigma": numbers(interval(|level| verdict.posterior.sigma_quantile(level))),
            "share": numbers(interval(|level| verdict.posterior.share_quantile(level))),
            "mode": { "share": share, "sigma": sigma },
        })
    });
    json!({
        "file": input::name(entry.path),
        "ball": entry.which,
        "balls": entry.of,
        "finish": finish.finish().map(Finish::name),
        "finishes": finishes,
        "no_single_finish": finish.none,
        "sigma": numbers(finish.sigma.interval(LEVEL)),
        "sigma_below": finish.sigma.below(),
        "share": numbers(finish.share.interval(LEVEL)),
        "base_colour": {
            "low": ends.map(|[low, _]| low),
            "median": finish.base_colour(),
            "high": ends.map(|[_, high]| high),
        },
        "metallic": finish.metallic(),
        "roughness": finish.sigma.quantile(0.5).sqrt(),
        "names": names,
        "circle": circle(&ball.circle),
        "others": ball.others.iter().map(circle).collect::<Vec<_>>(),
        "found": ball.found,
        "saturated": ball.saturated,
        "usable": ball.seen_where.usable(),
        "prints": ball.seen_where.share(Seen::Print),
        "reflections": ball.seen_where.share(Seen::Reflection),
        "seen": ball.seen,
        "elongation": ball.elongation.map(|found| json!({ "ratio": found.ratio, "angle": found.angle.to_degrees() })),
        "shape": ball.shape.map(|(coverage, left_out)| json!({ "coverage": coverage, "left_out": left_out })),
        "gain_map": ball.gain_map,
        "grey": ball.grey,
        "distance": ball.distance,
    })
}
