//! The figures of the paper.

use std::fmt::Write;

use crate::report::plot::{COLOURS, escape, header};
use crate::report::{Axis, Chart, Mark, Naming, Series};
use lobes::inference::Posterior;

/// The power spectra of natural light (the paper's Figure 1): one thin line an illumination, its
/// share of the power of l ≥ 1, and the median of all with the fitted range.
///
/// - `spectra`: (name, B_l for l = 0 … degree) of each illumination.
/// - `eta`: the median exponent, for the reference line k / l^(2+η).
pub fn light_spectra(spectra: &[(String, Vec<f64>)], eta: f64) -> String {
    let mut series = Vec::new();
    let shares: Vec<Vec<f64>> = spectra
        .iter()
        .map(|(_, b)| {
            let total: f64 = b.iter().skip(1).sum();
            b.iter().map(|power| power / total).collect()
        })
        .collect();
    for ((name, _), share) in spectra.iter().zip(&shares) {
        series.push(Series {
            name: name.clone(),
            naming: Naming::Tooltip,
            colour: "#9db7cf".into(),
            mark: Mark::Line(1.0),
            points: points(share),
        });
    }
    let degrees = shares.iter().map(Vec::len).min().unwrap_or(0);
    let median: Vec<f64> = (0..degrees)
        .map(|l| {
            let mut values: Vec<f64> = shares.iter().map(|share| share[l]).collect();
            values.sort_by(f64::total_cmp);
            values[values.len() / 2]
        })
        .collect();
    // The reference goes through the median's geometric centre.
    let centre: f64 = (1..degrees)
        .map(|l| median[l].ln() + (2.0 + eta) * (l as f64).ln())
        .sum::<f64>()
        / (degrees.max(2) - 1) as f64;
    series.push(Series {
        name: format!("k / l^{:.2}", 2.0 + eta),
        naming: Naming::Legend,
        colour: COLOURS[4].into(),
        mark: Mark::Dashes(2.0),
        points: (1..degrees)
            .map(|l| (l as f64, (centre - (2.0 + eta) * (l as f64).ln()).exp()))
            .collect(),
    });
    series.push(Series {
        // One map is no median.
        name: match spectra {
            [(name, _)] => name.clone(),
            _ => "median".into(),
        },
        naming: Naming::Legend,
        colour: COLOURS[1].into(),
        mark: Mark::Line(2.5),
        points: points(&median),
    });
    Chart {
        title: "Power spectra of natural light".into(),
        x_label: "degree l".into(),
        y_label: "average power, share of l ≥ 1".into(),
        x_axis: Axis::Logarithmic,
        y_axis: Axis::Logarithmic,
        series,
    }
    .svg()
}

fn points(spectrum: &[f64]) -> Vec<(f64, f64)> {
    let indexed = spectrum.iter().enumerate().skip(1);
    indexed.map(|(l, &power)| (l as f64, power)).collect()
}

/// The plane of v1 and v2 (the paper's Figure 2): one symbol an image, one colour a material, whose
/// name stands beside its images.
///
/// - `materials`: their names.
/// - `images`: (material, v1, v2) of each image.
pub fn feature_plane(materials: &[String], images: &[(usize, f64, f64)]) -> String {
    let series = materials.iter().enumerate().map(|(material, name)| Series {
        name: name.clone(),
        naming: Naming::AtPoints,
        colour: COLOURS[material % COLOURS.len()].into(),
        mark: Mark::Symbol(material),
        points: images
            .iter()
            .filter(|image| image.0 == material)
            .map(|image| (image.1, image.2))
            .collect(),
    });
    Chart {
        title: "Materials in the plane of v1 and v2".into(),
        x_label: "v1: share of the power in l ≤ 2".into(),
        y_label: "v2: mean of B_l / B_(l+1) over odd l ≥ 3".into(),
        x_axis: Axis::Linear,
        y_axis: Axis::Logarithmic,
        series: series.collect(),
    }
    .svg()
}

/// How often credible intervals hold the truth, by their level; on the diagonal they are honest.
///
/// - `coverage`: (level, coverage of σ, coverage of the specular share).
pub fn calibration(coverage: &[(f64, f64, f64)]) -> String {
    let line = |name: &str, colour: &str, mark, points| Series {
        name: name.into(),
        naming: Naming::Legend,
        colour: colour.into(),
        mark,
        points,
    };
    let of_sigma: Vec<(f64, f64)> = coverage.iter().map(|c| (c.0, c.1)).collect();
    let of_share: Vec<(f64, f64)> = coverage.iter().map(|c| (c.0, c.2)).collect();
    Chart {
        title: "Calibration of the credible intervals".into(),
        x_label: "level of the interval".into(),
        y_label: "share of pictures whose truth it holds".into(),
        x_axis: Axis::Linear,
        y_axis: Axis::Linear,
        series: vec![
            line(
                "honest",
                "#999999",
                Mark::Dashes(1.5),
                vec![(0.0, 0.0), (1.0, 1.0)],
            ),
            line("σ", COLOURS[1], Mark::Line(2.5), of_sigma),
            line("specular share", COLOURS[4], Mark::Line(2.5), of_share),
        ],
    }
    .svg()
}

/// How often answers are right, by the probability that they were given; on the diagonal the
/// probabilities are honest.
///
/// - `answers`: the name of each, and (mean probability, share that was right) by how probable it was said to be.
pub fn answers_calibration(answers: &[(&str, Vec<(f64, f64)>)]) -> String {
    let honest = Series {
        name: "honest".into(),
        naming: Naming::Legend,
        colour: "#999999".into(),
        mark: Mark::Dashes(1.5),
        points: vec![(0.0, 0.0), (1.0, 1.0)],
    };
    let of_answers = answers
        .iter()
        .enumerate()
        .map(|(i, (name, points))| Series {
            name: (*name).into(),
            naming: Naming::Legend,
            colour: COLOURS[i % COLOURS.len()].into(),
            mark: Mark::Line(2.0),
            points: points.clone(),
        });
    Chart {
        title: "Calibration of the finishes".into(),
        x_label: "probability that was said".into(),
        y_label: "share of photographs of which it was true".into(),
        x_axis: Axis::Linear,
        y_axis: Axis::Linear,
        series: [honest].into_iter().chain(of_answers).collect(),
    }
    .svg()
}

/// A posterior as a map: the specular share to the right, σ upwards by its logarithm, the darker
/// the likelier; the cross is its mode.
pub fn posterior_map(posterior: &Posterior) -> String {
    let (shares, sigmas) = (posterior.shares(), posterior.sigmas());
    let (left, top, cell_x, cell_y) = (64.0, 40.0, 16.0, 14.0);
    let (columns, rows) = (shares.len(), sigmas.len());
    let (wide, high) = (columns as f64 * cell_x, rows as f64 * cell_y);
    let (width, height) = (left + wide + 24.0, top + high + 48.0);
    let mut out = header(width, height, "Posterior");
    let largest = posterior
        .probabilities()
        .iter()
        .copied()
        .fold(f64::MIN_POSITIVE, f64::max);
    let place = |i: usize, j: usize| {
        (
            left + i as f64 * cell_x,
            top + (rows - 1 - j) as f64 * cell_y,
        )
    };
    for (at, p) in posterior.probabilities().iter().enumerate() {
        if p / largest < 0.001 {
            continue;
        }
        let (x, y) = place(at % columns, at / columns);
        let _ = writeln!(
            out,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{cell_x}\" height=\"{cell_y}\" fill=\"{}\" fill-opacity=\"{:.3}\"/>",
            COLOURS[1],
            p / largest
        );
    }
    let (share, sigma) = posterior.mode();
    let find = |axis: &[f64], value: f64| axis.iter().position(|v| *v == value).unwrap_or(0);
    let (x, y) = place(find(shares, share), find(sigmas, sigma));
    let (x, y) = (x + 0.5 * cell_x, y + 0.5 * cell_y);
    let _ = writeln!(
        out,
        "<path d=\"M{:.1} {y:.1}h12M{x:.1} {:.1}v12\" stroke=\"{}\" stroke-width=\"2\"/>\
         <rect x=\"{left}\" y=\"{top}\" width=\"{wide}\" height=\"{high}\" fill=\"none\" stroke=\"#999\"/>\
         <text x=\"16\" y=\"24\" font-size=\"15\" font-weight=\"600\">Posterior</text>",
        x - 6.0,
        y - 6.0,
        COLOURS[4]
    );
    for i in (0..columns).step_by((columns / 4).max(1)) {
        let (x, _) = place(i, 0);
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{:.2}</text>",
            x + 0.5 * cell_x,
            top + high + 18.0,
            shares[i]
        );
    }
    for j in (0..rows).step_by((rows / 5).max(1)) {
        let (_, y) = place(0, j);
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{:.3}</text>",
            left - 6.0,
            y + 0.5 * cell_y + 4.0,
            sigmas[j]
        );
    }
    let _ = writeln!(
        out,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">specular share</text>\
         <text transform=\"translate(16 {:.1}) rotate(-90)\" text-anchor=\"middle\">σ</text></svg>",
        left + 0.5 * wide,
        height - 8.0,
        top + 0.5 * high
    );
    out
}

/// A confusion matrix: rows are the truth, columns what was said.
pub fn confusion_matrix(materials: &[String], matrix: &[Vec<usize>]) -> String {
    let n = materials.len() as f64;
    // Names are set at 14, about 7.5 a letter, beside the rows and slanted by 50° above the
    // columns.
    let longest = materials.iter().map(|name| name.chars().count()).max();
    let name = 7.5 * longest.unwrap_or(0) as f64;
    let (cell, left, top) = (46.0, (24.0 + name).max(160.0), 64.0 + 0.77 * name);
    let (width, height) = (left + n * cell + 0.64 * name, top + n * cell + 8.0);
    let mut out = header(width, height, "Confusion matrix");
    let _ = writeln!(
        out,
        "<g font-size=\"14\"><text x=\"8\" y=\"22\" font-size=\"15\" font-weight=\"600\">Confusion</text>\
         <text x=\"8\" y=\"44\">row: truth</text><text x=\"8\" y=\"62\">column: said</text>"
    );
    for (i, name) in materials.iter().enumerate() {
        let centre = (i as f64 + 0.5) * cell;
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>\
             <text transform=\"translate({:.1} {:.1}) rotate(-50)\">{}</text>",
            left - 8.0,
            top + centre + 5.0,
            escape(name),
            left + centre,
            top - 8.0,
            escape(name)
        );
    }
    for (truth, row) in matrix.iter().enumerate() {
        let total: usize = row.iter().sum();
        for (said, &count) in row.iter().enumerate() {
            let share = count as f64 / total.max(1) as f64;
            let colour = if truth == said {
                COLOURS[1]
            } else {
                COLOURS[4]
            };
            let (x, y) = (left + said as f64 * cell, top + truth as f64 * cell);
            let _ = writeln!(
                out,
                "<rect x=\"{x}\" y=\"{y}\" width=\"{cell}\" height=\"{cell}\" fill=\"#888\" fill-opacity=\"0.1\" class=\"halo\" stroke=\"#fff\"/>\
                 <rect x=\"{x}\" y=\"{y}\" width=\"{cell}\" height=\"{cell}\" fill=\"{colour}\" fill-opacity=\"{:.3}\" class=\"halo\" stroke=\"#fff\"><title>{} called {}: {count} of {total}</title></rect>",
                if count == 0 { 0.0 } else { 0.15 + 0.85 * share },
                escape(&materials[truth]),
                escape(&materials[said])
            );
            if count > 0 {
                let ink = if share > 0.45 { "#fff" } else { "currentColor" };
                let _ = writeln!(
                    out,
                    "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"{ink}\">{count}</text>",
                    x + 0.5 * cell,
                    y + 0.5 * cell + 5.0
                );
            }
        }
    }
    out.push_str("</g></svg>\n");
    out
}
