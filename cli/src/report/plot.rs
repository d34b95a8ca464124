//! Charts as SVG: two axes, lines, points, a legend.

use std::fmt::Write;

/// How an axis is divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Axis {
    /// Equal steps.
    Linear,
    /// Equal ratios; values that are not positive are left out.
    Logarithmic,
}

/// How the points of a series are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Mark {
    /// A polyline of this width in pixels.
    Line(f64),
    /// A dashed polyline of this width.
    Dashes(f64),
    /// The n-th of eight symbols, one a point.
    Symbol(usize),
}

/// Where the name of a series stands, besides its tooltips.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Naming {
    /// In tooltips only.
    Tooltip,
    /// In the legend on the right.
    Legend,
    /// In the chart, beside the middle of its points.
    AtPoints,
}

/// Points of one kind.
#[derive(Debug, Clone)]
pub struct Series {
    /// What it is called.
    pub name: String,
    /// Where its name stands.
    pub naming: Naming,
    /// A CSS colour.
    pub colour: String,
    /// How it is drawn.
    pub mark: Mark,
    /// (x, y).
    pub points: Vec<(f64, f64)>,
}

/// A chart with two axes.
#[derive(Debug, Clone)]
pub struct Chart {
    /// The title above it.
    pub title: String,
    /// What stands under the x axis.
    pub x_label: String,
    /// What stands beside the y axis.
    pub y_label: String,
    /// How x is divided.
    pub x_axis: Axis,
    /// How y is divided.
    pub y_axis: Axis,
    /// What it shows; later series lie above earlier ones.
    pub series: Vec<Series>,
}

/// Eight colours that people with any colour vision tell apart (Okabe and Ito 2008), the yellow
/// darkened and black the colour of the text, which a page may change.
pub(crate) const COLOURS: [&str; 8] = [
    "currentColor",
    "#0072b2",
    "#e69f00",
    "#009e73",
    "#d55e00",
    "#cc79a7",
    "#56b4e9",
    "#b3a000",
];

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 460.0;
const LEFT: f64 = 76.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 44.0;
const BOTTOM: f64 = 58.0;
const LEGEND: f64 = 150.0;

/// The range of one axis and its way onto the page.
struct Scale {
    axis: Axis,
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Scale {
    fn new(axis: Axis, values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let usable = |v: &f64| v.is_finite() && (axis == Axis::Linear || *v > 0.0);
        let (mut low, mut high) = values
            .filter(usable)
            .map(|v| if axis == Axis::Linear { v } else { v.log10() })
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
                (l.min(v), h.max(v))
            });
        if !(low <= high) {
            (low, high) = (0.0, 1.0);
        }
        if high - low < 1e-9 {
            (low, high) = (low - 0.5, high + 0.5);
        }
        let margin = 0.04 * (high - low);
        Self {
            axis,
            low: low - margin,
            high: high + margin,
            from,
            to,
        }
    }

    /// The place on the page; `None` for a value that the axis cannot show.
    fn place(&self, value: f64) -> Option<f64> {
        let v = match self.axis {
            Axis::Linear => value,
            Axis::Logarithmic => value.log10(),
        };
        v.is_finite()
            .then(|| self.from + (v - self.low) / (self.high - self.low) * (self.to - self.from))
    }

    /// Values worth a labelled tick.
    fn ticks(&self) -> Vec<f64> {
        let span = self.high - self.low;
        match self.axis {
            Axis::Linear => {
                let raw = span / 6.0;
                let power = 10f64.powf(raw.log10().floor());
                let step = [1.0, 2.0, 5.0, 10.0]
                    .map(|m| m * power)
                    .into_iter()
                    .find(|&s| s >= raw)
                    .unwrap_or(power);
                let first = (self.low / step).ceil() as i64;
                let last = (self.high / step).floor() as i64;
                (first..=last).map(|i| i as f64 * step).collect()
            }
            Axis::Logarithmic => {
                let multiples: &[f64] = if span < 2.2 { &[1.0, 2.0, 5.0] } else { &[1.0] };
                let every = if span > 9.0 { 2 } else { 1 };
                (self.low.floor() as i32..=self.high.ceil() as i32)
                    .filter(|e| e % every == 0)
                    .flat_map(|e| multiples.iter().map(move |m| m * 10f64.powi(e)))
                    .filter(|v| (self.low..=self.high).contains(&v.log10()))
                    .collect()
            }
        }
    }
}

/// A number for a tick: short, and a power of ten as one.
fn tick_label(value: f64, axis: Axis) -> String {
    if axis == Axis::Logarithmic && !(0.01..10_000.0).contains(&value) {
        let exponent = value.log10().floor();
        let mantissa = value / 10f64.powf(exponent);
        let superscript: String = format!("{exponent}")
            .chars()
            .map(|c| match c {
                '-' => '⁻',
                '1' => '¹',
                '2' => '²',
                '3' => '³',
                digit => char::from_u32(0x2070 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
            })
            .collect();
        return if (mantissa - 1.0).abs() < 1e-6 {
            format!("10{superscript}")
        } else {
            format!("{mantissa:.0}·10{superscript}")
        };
    }
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.replace('-', "−")
    }
}

/// `text` with what XML reserves escaped.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// The n-th of eight symbols about a point.
fn symbol(out: &mut String, n: usize, x: f64, y: f64, colour: &str, tooltip: &str) {
    let r = 4.6;
    let polygon = |points: &[(f64, f64)]| {
        let points: Vec<String> = points
            .iter()
            .map(|(dx, dy)| format!("{:.1},{:.1}", x + dx * r, y + dy * r))
            .collect();
        format!("<polygon points=\"{}\"", points.join(" "))
    };
    let cross = |a: f64, b: f64| {
        format!(
            "<path d=\"M{:.1} {:.1}L{:.1} {:.1}M{:.1} {:.1}L{:.1} {:.1}\"",
            x - a * r,
            y - b * r,
            x + a * r,
            y + b * r,
            x - b * r,
            y + a * r,
            x + b * r,
            y - a * r
        )
    };
    let (shape, stroked) = match n % 8 {
        0 => (
            format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{:.1}\"", 0.9 * r),
            false,
        ),
        1 => (
            polygon(&[(-0.85, -0.85), (0.85, -0.85), (0.85, 0.85), (-0.85, 0.85)]),
            false,
        ),
        2 => (polygon(&[(0.0, -1.1), (1.0, 0.75), (-1.0, 0.75)]), false),
        3 => (
            polygon(&[(0.0, -1.2), (0.9, 0.0), (0.0, 1.2), (-0.9, 0.0)]),
            false,
        ),
        4 => (polygon(&[(0.0, 1.1), (1.0, -0.75), (-1.0, -0.75)]), false),
        5 => (cross(0.9, 0.9), true),
        6 => (
            format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{:.1}\"", 0.85 * r),
            true,
        ),
        _ => (cross(1.1, 0.0), true),
    };
    let style = if stroked {
        format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"")
    } else {
        format!("fill=\"{colour}\" class=\"halo\" stroke=\"#fff\" stroke-width=\"0.7\"")
    };
    let _ = writeln!(
        out,
        "{shape} {style}><title>{}</title>{}",
        escape(tooltip),
        close(&shape)
    );
}

/// The closing tag of an element that starts like `shape`.
fn close(shape: &str) -> &'static str {
    if shape.starts_with("<circle") {
        "</circle>"
    } else if shape.starts_with("<path") {
        "</path>"
    } else {
        "</polygon>"
    }
}

impl Chart {
    /// The chart as an SVG document.
    pub fn svg(&self) -> String {
        let legend: Vec<&Series> = (self.series.iter())
            .filter(|s| s.naming == Naming::Legend)
            .collect();
        let right = WIDTH - RIGHT - if legend.is_empty() { 0.0 } else { LEGEND };
        let bottom = HEIGHT - BOTTOM;
        let all = || self.series.iter().flat_map(|s| s.points.iter());
        let x = Scale::new(self.x_axis, all().map(|p| p.0), LEFT, right);
        let y = Scale::new(self.y_axis, all().map(|p| p.1), bottom, TOP);

        let mut out = header(WIDTH, HEIGHT, &self.title);
        let _ = writeln!(
            out,
            "<text x=\"{LEFT}\" y=\"24\" font-size=\"15\" font-weight=\"600\">{}</text>",
            escape(&self.title)
        );
        for value in x.ticks() {
            if let Some(px) = x.place(value) {
                let _ = writeln!(
                    out,
                    "<line x1=\"{px:.1}\" x2=\"{px:.1}\" y1=\"{TOP}\" y2=\"{bottom}\" class=\"rule\" stroke=\"#e6e6e6\"/>\
                     <text x=\"{px:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                    bottom + 18.0,
                    tick_label(value, self.x_axis)
                );
            }
        }
        for value in y.ticks() {
            if let Some(py) = y.place(value) {
                let _ = writeln!(
                    out,
                    "<line x1=\"{LEFT}\" x2=\"{right:.1}\" y1=\"{py:.1}\" y2=\"{py:.1}\" class=\"rule\" stroke=\"#e6e6e6\"/>\
                     <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                    LEFT - 8.0,
                    py + 4.0,
                    tick_label(value, self.y_axis)
                );
            }
        }
        let _ = writeln!(
            out,
            "<path d=\"M{LEFT} {TOP}V{bottom}H{right:.1}\" fill=\"none\" stroke=\"#888\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\
             <text transform=\"translate(20 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            0.5 * (LEFT + right),
            HEIGHT - 16.0,
            escape(&self.x_label),
            0.5 * (TOP + bottom),
            escape(&self.y_label)
        );
        for series in &self.series {
            self.draw(&mut out, series, &x, &y);
        }
        self.name_at_points(&mut out, &x, &y);
        for (i, series) in legend.iter().enumerate() {
            let (lx, ly) = (right + 20.0, TOP + 14.0 + 20.0 * i as f64);
            match series.mark {
                Mark::Symbol(n) => symbol(&mut out, n, lx + 6.0, ly, &series.colour, &series.name),
                Mark::Line(width) | Mark::Dashes(width) => {
                    let _ = writeln!(
                        out,
                        "<line x1=\"{:.1}\" x2=\"{:.1}\" y1=\"{ly:.1}\" y2=\"{ly:.1}\" stroke=\"{}\" stroke-width=\"{}\"{}/>",
                        lx - 4.0,
                        lx + 16.0,
                        series.colour,
                        width.max(1.5),
                        dashes(series.mark)
                    );
                }
            }
            let _ = writeln!(
                out,
                "<text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                lx + 22.0,
                ly + 4.0,
                escape(&series.name)
            );
        }
        out.push_str("</svg>\n");
        out
    }

    fn draw(&self, out: &mut String, series: &Series, x: &Scale, y: &Scale) {
        let places = series.points.iter().filter_map(|&(px, py)| {
            let (a, b) = (x.place(px)?, y.place(py)?);
            Some((px, py, a, b))
        });
        match series.mark {
            Mark::Symbol(n) => {
                for (px, py, a, b) in places {
                    let tooltip = format!("{}: {px:.4}, {py:.4}", series.name);
                    symbol(out, n, a, b, &series.colour, &tooltip);
                }
            }
            Mark::Line(width) | Mark::Dashes(width) => {
                let path: Vec<String> = places
                    .map(|(_, _, a, b)| format!("{a:.1},{b:.1}"))
                    .collect();
                let path = path.join(" ");
                // What has its name in a tooltip alone gets a wide line that is not seen, for a
                // pointer to meet.
                let wide = if series.naming == Naming::Tooltip {
                    format!(
                        "<polyline points=\"{path}\" fill=\"none\" stroke=\"{}\" stroke-opacity=\"0\" stroke-width=\"9\"/>",
                        series.colour
                    )
                } else {
                    String::new()
                };
                let _ = writeln!(
                    out,
                    "<g class=\"line\"><title>{}</title>{wide}<polyline points=\"{path}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{}/></g>",
                    escape(&series.name),
                    series.colour,
                    dashes(series.mark)
                );
            }
        }
    }
}

/// A label's box: left, top, right, bottom.
type Area = [f64; 4];

/// How much of two boxes is the same.
fn overlap(a: &Area, b: &Area) -> f64 {
    let wide = a[2].min(b[2]) - a[0].max(b[0]);
    let high = a[3].min(b[3]) - a[1].max(b[1]);
    wide.max(0.0) * high.max(0.0)
}

impl Chart {
    /// Writes the names of those series that have them at their points, each where it covers least
    /// of the points and of the other names, with a line to the middle of its points where it
    /// stands off.
    fn name_at_points(&self, out: &mut String, x: &Scale, y: &Scale) {
        let places = |series: &Series| -> Vec<(f64, f64)> {
            let placed = series.points.iter();
            placed
                .filter_map(|&(px, py)| Some((x.place(px)?, y.place(py)?)))
                .collect()
        };
        let all: Vec<(f64, f64)> = self.series.iter().flat_map(places).collect();
        let mut taken: Vec<Area> = Vec::new();
        for series in (self.series.iter()).filter(|s| s.naming == Naming::AtPoints) {
            let own = places(series);
            if own.is_empty() {
                continue;
            }
            let middle = |values: &mut Vec<f64>| {
                values.sort_by(f64::total_cmp);
                values[values.len() / 2]
            };
            let mut xs: Vec<f64> = own.iter().map(|p| p.0).collect();
            let mut ys: Vec<f64> = own.iter().map(|p| p.1).collect();
            let centre = (middle(&mut xs), middle(&mut ys));
            // Names are set in bold at 12: about 7 a letter, and the symbol before them.
            let (wide, high) = (20.0 + 7.0 * series.name.chars().count() as f64, 16.0);
            let area_at = |dx: f64, dy: f64| {
                let (left, top) = (centre.0 + dx - 0.5 * wide, centre.1 + dy - 0.5 * high);
                [left, top, left + wide, top + high]
            };
            let cost = |area: &Area, off: f64| {
                let outside = (x.from - area[0]).max(0.0)
                    + (area[2] - x.to).max(0.0)
                    + (y.to - area[1]).max(0.0)
                    + (area[3] - y.from).max(0.0);
                let covered = all.iter().filter(|p| {
                    (area[0] - 3.0..=area[2] + 3.0).contains(&p.0)
                        && (area[1] - 3.0..=area[3] + 3.0).contains(&p.1)
                });
                let names: f64 = taken.iter().map(|other| overlap(area, other)).sum();
                100.0 * outside + 8.0 * covered.count() as f64 + 4.0 * names + 0.35 * off
            };
            let mut best = (f64::INFINITY, area_at(0.0, 0.0));
            for ring in 1..16 {
                for direction in 0..16 {
                    let (sin, cos) =
                        (std::f64::consts::TAU * f64::from(direction) / 16.0).sin_cos();
                    let off = 12.0 * f64::from(ring);
                    let area = area_at((off + 0.45 * wide) * cos, off * sin);
                    let cost = cost(&area, off);
                    if cost < best.0 {
                        best = (cost, area);
                    }
                }
            }
            let area = best.1;
            taken.push(area);
            let near = (
                centre.0.clamp(area[0], area[2]),
                centre.1.clamp(area[1], area[3]),
            );
            if (near.0 - centre.0).hypot(near.1 - centre.1) > 10.0 {
                let _ = writeln!(
                    out,
                    "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{}\" stroke-width=\"1\"/>",
                    near.0, near.1, centre.0, centre.1, series.colour
                );
            }
            if let Mark::Symbol(n) = series.mark {
                let (px, py) = (area[0] + 8.0, 0.5 * (area[1] + area[3]));
                symbol(out, n, px, py, &series.colour, &series.name);
            }
            let _ = writeln!(
                out,
                "<text x=\"{:.1}\" y=\"{:.1}\" font-weight=\"700\" class=\"halo\" stroke=\"#fff\" stroke-width=\"3\" \
                 stroke-linejoin=\"round\" paint-order=\"stroke\">{}</text>",
                area[0] + 17.0,
                area[3] - 4.0,
                escape(&series.name)
            );
        }
    }
}

fn dashes(mark: Mark) -> &'static str {
    match mark {
        Mark::Dashes(_) => " stroke-dasharray=\"6 4\"",
        _ => "",
    }
}

/// The head of an SVG document on a white ground.
///
/// What is not said in `currentColor` is white ground (class `ground`), an edge of it (`halo`) or a
/// thin rule (`rule`), whose colours a page that holds the drawing may change.
pub(crate) fn header(width: f64, height: f64, title: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"system-ui, sans-serif\" font-size=\"12\" color=\"#222\" fill=\"currentColor\" role=\"img\">\n\
         <title>{}</title>\n<rect width=\"{width}\" height=\"{height}\" class=\"ground\" fill=\"#fff\"/>\n",
        escape(title)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let scale = Scale::new(Axis::Linear, [0.13, 0.97].into_iter(), 0.0, 100.0);
        let ticks = scale.ticks();
        assert!(ticks.len() >= 3, "{ticks:?}");
        for tick in ticks {
            assert!((tick * 10.0 - (tick * 10.0).round()).abs() < 1e-9, "{tick}");
            let place = scale.place(tick).unwrap();
            assert!((0.0..=100.0).contains(&place), "{place}");
        }
    }

    #[test]
    fn labels_read_as_people_write() {
        assert_eq!(tick_label(1e-5, Axis::Logarithmic), "10⁻⁵");
        assert_eq!(tick_label(0.5, Axis::Linear), "0.5");
        assert_eq!(tick_label(-2.0, Axis::Linear), "−2");
    }

    #[test]
    fn names_are_escaped_and_unshowable_points_left_out() {
        let chart = Chart {
            title: "a < b".into(),
            x_label: String::new(),
            y_label: String::new(),
            x_axis: Axis::Logarithmic,
            y_axis: Axis::Linear,
            series: vec![Series {
                name: "R&D".into(),
                naming: Naming::Legend,
                colour: "#000".into(),
                mark: Mark::Line(1.0),
                points: vec![(0.0, 1.0), (1.0, f64::NAN), (10.0, 2.0)],
            }],
        };
        let svg = chart.svg();
        assert!(svg.contains("a &lt; b") && svg.contains("R&amp;D"));
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }

    #[test]
    fn names_stand_beside_their_points_and_not_on_each_other() {
        let series = |name: &str| Series {
            name: name.into(),
            naming: Naming::AtPoints,
            colour: "currentColor".into(),
            mark: Mark::Symbol(0),
            points: vec![(0.9, 1.0), (1.0, 1.1), (1.0, 1.2)],
        };
        let names = ["brown matte", "white matte", "sky plastic"];
        let svg = Chart {
            title: "t".into(),
            x_label: String::new(),
            y_label: String::new(),
            x_axis: Axis::Linear,
            y_axis: Axis::Logarithmic,
            series: names.map(series).to_vec(),
        }
        .svg();
        let places: Vec<(f64, f64)> = names
            .iter()
            .map(|name| {
                let end = svg.find(&format!(">{name}</text>")).unwrap();
                let start = svg[..end].rfind("<text").unwrap();
                let number = |key: &str| -> f64 {
                    let rest = &svg[start..end];
                    let rest = &rest[rest.find(key).unwrap() + key.len()..];
                    rest[..rest.find('"').unwrap()].parse().unwrap()
                };
                (number("x=\""), number("y=\""))
            })
            .collect();
        for (i, a) in places.iter().enumerate() {
            assert!((LEFT..WIDTH - RIGHT - 70.0).contains(&a.0), "{a:?}");
            for b in &places[..i] {
                assert!(
                    (a.1 - b.1).abs() > 13.0 || (a.0 - b.0).abs() > 90.0,
                    "{places:?}"
                );
            }
        }
    }
}
