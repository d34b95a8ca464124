//! What the paper says, beside what a run measures of it.

use crate::report::AccuracyRow;
use lobes::features::{PaperFeatures, TOP_DEGREE};
use lobes::illumination::LightSpectrum;
use lobes::reflectance::{Material, lambert};
use lobes_experiments::Evaluation;

/// One statement of the paper.
pub(super) struct Statement {
    /// What the paper says.
    pub(super) said: String,
    /// What this run has measured of it.
    pub(super) measured: String,
    pub(super) verdict: Verdict,
}

/// Whether a statement holds here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    Holds,
    /// Where the statement is a rate: ours is higher, beyond the interval.
    Higher,
    /// Where the statement is a rate: ours is lower, beyond the interval.
    Lower,
    InPart,
    Fails,
    /// Nothing here is what the statement is about.
    NotApplicable,
    /// This run was not asked for it.
    NotMeasured,
}

impl Verdict {
    /// As the table has it.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::Higher => "higher here",
            Self::Lower => "lower here",
            Self::InPart => "in part",
            Self::Fails => "does not hold",
            Self::NotApplicable => "not applicable",
            Self::NotMeasured => "not measured",
        }
    }

    /// The class of its row.
    pub(super) fn class(self) -> &'static str {
        match self {
            Self::Holds | Self::Higher => "good",
            Self::Lower | Self::Fails => "bad",
            Self::InPart | Self::NotApplicable | Self::NotMeasured => "open",
        }
    }
}

/// The features of one image.
pub(super) struct Seen {
    pub(super) material: usize,
    pub(super) illumination: usize,
    pub(super) features: PaperFeatures,
}

/// What a run has, of which statements are judged.
pub(super) struct Run<'a> {
    pub(super) materials: &'a [Material],
    pub(super) seen: &'a [Seen],
    /// The paper's features, scaled by the default.
    pub(super) row: &'a AccuracyRow,
    /// Dror, Adelson and Willsky's features, by the nearest neighbour.
    pub(super) rival: &'a Evaluation,
    /// The paper's features on simulated photographs.
    pub(super) photographs: Option<&'a AccuracyRow>,
    pub(super) spectra: &'a [LightSpectrum],
}

/// The paper's rate beside the interval of ours.
fn rate(paper: f64, interval: [f64; 2]) -> Verdict {
    if interval[0] > paper {
        Verdict::Higher
    } else if interval[1] < paper {
        Verdict::Lower
    } else {
        Verdict::Holds
    }
}

/// The middle value; nothing of nothing.
fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// ρ_s / ρ_d, of the means of the channels.
fn ratio(material: &Material) -> f64 {
    let sum = |rgb: [f64; 3]| rgb.iter().sum::<f64>();
    sum(material.specular()) / sum(material.diffuse())
}

fn counted(correct: usize, total: usize, interval: [f64; 2]) -> String {
    format!(
        "{correct} of {total} = {:.1} % (95 % interval {:.1} – {:.1})",
        100.0 * correct as f64 / total.max(1) as f64,
        100.0 * interval[0],
        100.0 * interval[1]
    )
}

impl Run<'_> {
    /// Every statement, in the order in which the page has them.
    pub(super) fn statements(&self) -> Vec<Statement> {
        vec![
            self.table(),
            self.rival_table(),
            self.misses(),
            self.matte_v1(),
            self.matte_v2(),
            self.near_lambert(),
            self.roll_off(),
            self.light(),
            self.photographs(),
        ]
    }

    fn table(&self) -> Statement {
        Statement {
            said: "The features name 68 of 72 spheres, 94.4 % (Table 1).".into(),
            measured: counted(self.row.correct, self.row.total, self.row.ci95),
            verdict: rate(0.944, self.row.ci95),
        }
    }

    fn rival_table(&self) -> Statement {
        let (low, high) = self.rival.interval();
        let interval = [low, high];
        Statement {
            said: "The features of Dror, Adelson and Willsky name 78.8 % of the same spheres."
                .into(),
            measured: format!(
                "{}, by our reading of them and the nearest neighbour",
                counted(self.rival.correct(), self.rival.total(), interval)
            ),
            verdict: rate(0.788, interval),
        }
    }

    fn misses(&self) -> Statement {
        let golds = ["gold", "old gold"];
        let said = "All four misses are spheres of gold and old gold.".into();
        let here = |name: &&str| self.materials.iter().any(|m| m.name() == *name);
        if !golds.iter().all(here) {
            return Statement {
                said,
                measured: "Gold and old gold are not among these materials.".into(),
                verdict: Verdict::NotApplicable,
            };
        }
        let misses = &self.row.confusions;
        let of_golds = |name: &String| golds.contains(&name.as_str());
        let own = misses.iter().filter(|miss| of_golds(&miss.truth));
        let (own, other) = own.fold((0, 0), |(own, other), miss| {
            (own + 1, other + usize::from(of_golds(&miss.said)))
        });
        Statement {
            said,
            measured: format!(
                "{own} of {} misses are; {other} of them are called the other of the two.",
                misses.len()
            ),
            verdict: match own {
                0 => Verdict::Fails,
                n if n == misses.len() => Verdict::Holds,
                _ => Verdict::InPart,
            },
        }
    }

    /// A feature of every matte sphere.
    fn of_matte(&self, feature: usize) -> Vec<f64> {
        (self.seen.iter())
            .filter(|seen| self.materials[seen.material].is_matte())
            .map(|seen| seen.features.power[feature])
            .collect()
    }

    /// v1 of what a matte sphere reflects over the whole sphere of normals, under each map.
    fn whole_v1(&self) -> impl Iterator<Item = f64> {
        self.spectra.iter().map(|spectrum| {
            let power = |l: usize| lambert::transfer(l).powi(2) * spectrum.luminance[l];
            let degrees = spectrum.luminance.len().min(TOP_DEGREE + 1);
            let first: f64 = (0..degrees.min(3)).map(power).sum();
            first / (0..degrees).map(power).sum::<f64>()
        })
    }

    fn matte_v1(&self) -> Statement {
        let said = "v1 of matte spheres passes 99 %.".into();
        let values = self.of_matte(0);
        let Some(middle) = median(values.iter().copied()) else {
            return no_matte(said);
        };
        let above = values.iter().filter(|v1| **v1 > 0.99).count();
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let whole = self.whole_v1().fold(f64::INFINITY, f64::min);
        Statement {
            said,
            measured: format!(
                "In {above} of {} pictures of matte spheres; the median is {:.2} %, the least {:.2} %. Over the whole sphere, of which a picture \
                 shows half, it is {:.2} % or more under every map.",
                values.len(),
                100.0 * middle,
                100.0 * least,
                100.0 * whole
            ),
            verdict: if above == values.len() {
                Verdict::Holds
            } else if whole > 0.99 || above > 0 {
                Verdict::InPart
            } else {
                Verdict::Fails
            },
        }
    }

    fn matte_v2(&self) -> Statement {
        let said = "v2 of matte spheres is near zero.".into();
        let values = self.of_matte(1);
        let Some(middle) = median(values.iter().copied()) else {
            return no_matte(said);
        };
        let near = values.iter().filter(|v2| **v2 < 0.1).count();
        let others = (self.seen.iter()).filter(|seen| !self.materials[seen.material].is_matte());
        let others = median(others.map(|seen| seen.features.power[1]));
        let beside = others.map_or_else(String::new, |v2| format!(", of all others {v2:.2}"));
        Statement {
            said,
            measured: format!(
                "Below 0.1 in {near} of {} pictures; the median is {middle:.2}{beside}. Over the whole sphere it is 0, for no odd degree past 1 \
                 leaves a matte surface: the rest comes of filling in the half that a picture does not show.",
                values.len()
            ),
            verdict: match near {
                n if n == values.len() => Verdict::Holds,
                0 => Verdict::Fails,
                _ => Verdict::InPart,
            },
        }
    }

    /// The middle of a material's images in the plane of v1 and ln v2.
    fn middle(&self, materials: impl Fn(usize) -> bool) -> Option<(f64, f64)> {
        let of = |value: fn(&PaperFeatures) -> f64| {
            let seen = self.seen.iter().filter(|seen| materials(seen.material));
            median(seen.map(|seen| value(&seen.features)))
        };
        Some((of(|f| f.power[0])?, of(|f| f.power[1].ln())?))
    }

    fn near_lambert(&self) -> Statement {
        let said: String =
            "Sky plastic, whose ρ_s / ρ_d is the least of the glossy ones, lies near Lambert in the plane of v1 and v2.".into();
        let glossy: Vec<usize> = (0..self.materials.len())
            .filter(|&i| !self.materials[i].is_matte())
            .collect();
        let matte = self.middle(|i| self.materials[i].is_matte());
        let (Some(matte), true) = (matte, glossy.len() > 1) else {
            return Statement {
                said,
                measured: "It takes matte materials and at least two others.".into(),
                verdict: Verdict::NotApplicable,
            };
        };
        // Distances count in standard deviations of all images.
        let deviation = |value: fn(&PaperFeatures) -> f64| {
            let values: Vec<f64> = self.seen.iter().map(|s| value(&s.features)).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
            (squares / values.len() as f64)
                .sqrt()
                .max(f64::MIN_POSITIVE)
        };
        let (wide, high) = (deviation(|f| f.power[0]), deviation(|f| f.power[1].ln()));
        let mut order: Vec<(f64, usize)> = (glossy.iter())
            .filter_map(|&i| {
                let middle = self.middle(|material| material == i)?;
                let off = ((middle.0 - matte.0) / wide).hypot((middle.1 - matte.1) / high);
                Some((off, i))
            })
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let least = glossy
            .into_iter()
            .min_by(|&a, &b| ratio(&self.materials[a]).total_cmp(&ratio(&self.materials[b])));
        let place = order.iter().position(|(_, i)| Some(*i) == least);
        let (Some(place), Some(last)) = (place, order.last()) else {
            return no_matte(said);
        };
        let name = |i: usize| self.materials[i].name();
        let ahead = match place {
            0 => format!(
                "the nearest; next comes {} at {:.2}",
                name(order[1].1),
                order[1].0
            ),
            _ => format!(
                "number {} of {}, after {}",
                place + 1,
                order.len(),
                name(order[0].1)
            ),
        };
        Statement {
            said,
            measured: format!(
                "Here that is {}: {:.2} standard deviations of all images from the matte ones, {ahead}. The farthest is {} at {:.2}.",
                name(order[place].1),
                order[place].0,
                name(last.1),
                last.0
            ),
            verdict: if place == 0 {
                Verdict::Holds
            } else {
                Verdict::Fails
            },
        }
    }

    fn roll_off(&self) -> Statement {
        let said =
            "v7, the degree by which 98 % of the power is reached, grows with ρ_s / ρ_d.".into();
        let ratios: Vec<f64> = self.materials.iter().map(ratio).collect();
        let (mut agreeing, mut pairs) = (0.0, 0);
        for a in self.seen {
            for b in self.seen {
                if a.illumination == b.illumination && ratios[a.material] < ratios[b.material] {
                    let (first, second) = (a.features.power[6], b.features.power[6]);
                    agreeing += match first.total_cmp(&second) {
                        std::cmp::Ordering::Less => 1.0,
                        std::cmp::Ordering::Equal => 0.5,
                        std::cmp::Ordering::Greater => 0.0,
                    };
                    pairs += 1;
                }
            }
        }
        if pairs == 0 {
            return Statement {
                said,
                measured: "All these materials have the same ratio.".into(),
                verdict: Verdict::NotApplicable,
            };
        }
        let share = agreeing / f64::from(pairs);
        let mut order: Vec<usize> = (0..self.materials.len()).collect();
        order.sort_by(|&a, &b| ratios[a].total_cmp(&ratios[b]));
        let medians = order.iter().filter_map(|&i| {
            let own = self.seen.iter().filter(|seen| seen.material == i);
            let v7 = median(own.map(|seen| seen.features.power[6]))?;
            Some(format!("{} {v7}", self.materials[i].name()))
        });
        Statement {
            said,
            measured: format!(
                "In {:.0} % of the pairs of materials in one light the one with more gloss has the larger v7. Medians, by rising ratio: {}.",
                100.0 * share,
                medians.collect::<Vec<_>>().join(", ")
            ),
            verdict: match share {
                s if s >= 0.9 => Verdict::Holds,
                s if s > 0.6 => Verdict::InPart,
                _ => Verdict::Fails,
            },
        }
    }

    fn light(&self) -> Statement {
        const RANGE: std::ops::RangeInclusive<f64> = 0.3..=0.65;
        let count = |eta: fn(&LightSpectrum) -> Option<f64>| {
            let all = || self.spectra.iter().filter_map(eta);
            let within = all().filter(|eta| RANGE.contains(eta));
            (within.count(), median(all()))
        };
        let (plain, middle) = count(|s| Some(s.law.eta));
        let (clipped, clipped_middle) = count(|s| s.clipped_eta);
        let total = self.spectra.len();
        let number = |eta: Option<f64>| eta.unwrap_or(f64::NAN);
        Statement {
            said: "The power of natural light falls as k / l^(2+η); η is 0.3 and 0.65 in its two examples.".into(),
            measured: format!(
                "η is in that range for {plain} of {total} maps as they are (median {}) and for {clipped} of {total} with the brightest {} % of the \
                 sphere clipped (median {}).",
                signed(number(middle)),
                100.0 * LightSpectrum::CLIPPED_SHARE,
                signed(number(clipped_middle))
            ),
            verdict: match plain.max(clipped) {
                0 => Verdict::Fails,
                _ if plain == total => Verdict::Holds,
                _ => Verdict::InPart,
            },
        }
    }

    fn photographs(&self) -> Statement {
        let said = "On photographs of spheres the features name 53 % (Dror, Adelson and Willsky's 67.7 %).".into();
        match self.photographs {
            Some(row) => Statement {
                said,
                measured: format!(
                    "{}, on simulated photographs: there is no real one in the repository",
                    counted(row.correct, row.total, row.ci95)
                ),
                verdict: rate(0.53, row.ci95),
            },
            None => Statement {
                said,
                measured: "Not in this run: add --protocol photograph, which simulates them."
                    .into(),
                verdict: Verdict::NotMeasured,
            },
        }
    }
}

fn no_matte(said: String) -> Statement {
    Statement {
        said,
        measured: "None of these materials is matte.".into(),
        verdict: Verdict::NotApplicable,
    }
}

/// A number of two decimals with the sign that people write.
pub(super) fn signed(value: f64) -> String {
    format!("{value:.2}").replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::NamedConfusion;
    use lobes::illumination::PowerLaw;
    use lobes::reflectance::presets;

    fn row(correct: usize, ci95: [f64; 2], confusions: &[[&str; 2]]) -> AccuracyRow {
        let named = |[truth, said]: &[&str; 2]| NamedConfusion {
            illumination: "light".into(),
            truth: (*truth).into(),
            said: (*said).into(),
        };
        AccuracyRow {
            protocol: "paper".into(),
            classifier: "nearest-neighbour".into(),
            scaling: "logarithmic".into(),
            continuation: "mirror".into(),
            lobe: "sampled".into(),
            correct,
            total: 72,
            accuracy: correct as f64 / 72.0,
            ci95,
            finish: correct,
            confusions: confusions.iter().map(named).collect(),
        }
    }

    /// One image of each material, whose v1, v2 and v7 are as the paper says; or matte ones are
    /// those of a mirror.
    fn images(materials: &[Material], turned: bool) -> Vec<Seen> {
        let image = |(material, parameters): (usize, &Material)| {
            let gloss = ratio(parameters).min(100.0) / (1.0 + ratio(parameters).min(100.0));
            // More than any other, so that no rounding makes two alike.
            let gloss = if turned && parameters.is_matte() {
                1.2
            } else {
                gloss
            };
            let mut power = [1.0; 7];
            power[0] = 1.0 - 0.5 * gloss;
            power[1] = 0.01 + gloss;
            power[6] = (2.0 + 40.0 * gloss).round();
            Seen {
                material,
                illumination: 0,
                features: PaperFeatures {
                    power,
                    colour: [1.0; 3],
                },
            }
        };
        materials.iter().enumerate().map(image).collect()
    }

    fn light(eta: f64) -> LightSpectrum {
        let law = PowerLaw {
            k: 1.0,
            eta,
            eta_error: 0.1,
            ln_k_error: 0.1,
        };
        let luminance: Vec<f64> = (0..=128)
            .map(|l| f64::from(l.max(1)).powf(-2.0 - eta))
            .collect();
        LightSpectrum {
            channels: [luminance.clone(), luminance.clone(), luminance.clone()],
            luminance,
            law,
            etas: [Some(eta); 3],
            coherence: None,
            clipped_eta: Some(eta),
        }
    }

    fn verdicts(
        materials: &[Material],
        seen: &[Seen],
        row: &AccuracyRow,
        photographs: Option<&AccuracyRow>,
        eta: f64,
    ) -> Vec<Verdict> {
        // 57 of 72 are 79.2 %.
        let said = (0..72).map(|i| usize::from(i >= 57)).collect();
        let rival = Evaluation {
            observations: (0..72).collect(),
            said,
            truth: vec![0; 72],
            scores: Vec::new(),
            labels: 2,
        };
        let run = Run {
            materials,
            seen,
            row,
            rival: &rival,
            photographs,
            spectra: &[light(eta)],
        };
        let statements = run.statements();
        for statement in &statements {
            assert!(!statement.said.is_empty() && !statement.measured.contains("NaN"));
        }
        statements
            .iter()
            .map(|statement| statement.verdict)
            .collect()
    }

    #[test]
    fn each_statement_holds_where_it_does() {
        use Verdict::*;
        let materials = presets();
        let golds = [["gold", "old gold"], ["old gold", "silver"]];
        let row_here = row(68, [0.87, 0.98], &golds);
        let photographs = row(38, [0.41, 0.64], &[]);
        let seen = images(&materials, false);
        let got = verdicts(&materials, &seen, &row_here, Some(&photographs), 0.5);
        assert_eq!(got, [Holds; 9]);
    }

    #[test]
    fn each_statement_fails_where_it_does_not_hold() {
        use Verdict::*;
        let materials = presets();
        let row_here = row(50, [0.58, 0.79], &[["silver", "gold"]]);
        let photographs = row(60, [0.73, 0.90], &[]);
        let seen = images(&materials, true);
        let got = verdicts(&materials, &seen, &row_here, Some(&photographs), -1.9);
        assert_eq!(
            got,
            [
                Lower, Holds, Fails, InPart, Fails, Fails, Fails, Fails, Higher
            ]
        );
    }

    #[test]
    fn a_statement_about_what_is_not_here_is_not_applicable() {
        use Verdict::*;
        let materials = [
            Material::metal("tin", [0.8; 3], 0.9, 0.1).unwrap(),
            Material::metal("zinc", [0.8; 3], 0.9, 0.1).unwrap(),
        ];
        let seen = images(&materials, false);
        let row_here = row(72, [0.95, 1.0], &[]);
        let got = verdicts(&materials, &seen, &row_here, None, 0.5);
        assert_eq!(got[0], Higher);
        assert_eq!(got[2..7], [NotApplicable; 5]);
        assert_eq!(got[8], NotMeasured);
    }
}
