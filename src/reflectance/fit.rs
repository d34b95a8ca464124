//! Fitting Ward's lobes to measured reflectance.
//!
//! The model is `f = ρ_d/π + ρ_s f_Ward(σ)`, and what is made small is `Σ w cos²θ_i (f − value)²`,
//! the measure of Ngan, Durand and Matusik 2005, *Experimental Analysis of BRDF Models*
//! ([doi:10.2312/EGWR/EGSR05/117-126](https://doi.org/10.2312/EGWR/EGSR05/117-126)).

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI};
use std::path::Path;

use glam::DVec3;
use nalgebra::{DMatrix, DVector};

use super::direction::{HORIZON, visible};
use super::variant::Variant;
use super::ward::{MIN_SIGMA, Ward};
use crate::{Error, Result};

/// One measured value of a BRDF.
///
/// ```
/// use lobes::glam::DVec3;
/// use lobes::reflectance::fit::Measurement;
/// // A white diffuse surface, lit at 45° and seen along its normal.
/// let light = DVec3::new(0.5f64.sqrt(), 0.0, 0.5f64.sqrt());
/// let value = std::f64::consts::FRAC_1_PI;
/// let measured = Measurement { light, view: DVec3::Z, value, weight: 1.0 };
/// assert!((measured.value * std::f64::consts::PI - 1.0).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// The direction to the light, in the surface's frame.
    pub light: DVec3,
    /// The direction to the sensor, in the surface's frame.
    pub view: DVec3,
    /// The BRDF, in sr⁻¹.
    pub value: f64,
    /// What the measurement counts: the solid angle that it stands for, or 1.
    pub weight: f64,
}

/// Whether the lobe is round.
///
/// ```
/// # use lobes::glam::DVec3;
/// # use lobes::reflectance::{Variant, Ward, fit::{fit, residuals, Measurement, Widths}};
/// # let lobe = Ward::isotropic(Variant::Duer, 0.1)?;
/// # let view = DVec3::new(0.6, 0.0, 0.8);
/// # let measurements: Vec<_> = (0..50).map(|i| {
/// #     let angle = 0.03 * f64::from(i) - 0.1;
/// #     let light = DVec3::new(-angle.sin(), 0.0, angle.cos());
/// #     let value = 0.2 / std::f64::consts::PI + 0.3 * lobe.evaluate(view, light) / light.z;
/// #     Measurement { light, view, value, weight: 1.0 }
/// # }).collect();
/// // `measurements` lie in one plane, so that they cannot tell the width across it.
/// assert!(fit(&measurements, Variant::Duer, Widths::One).is_ok());
/// assert!(fit(&measurements, Variant::Duer, Widths::Two).is_err());
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
pub enum Widths {
    /// One σ.
    #[default]
    One,
    /// `σ_x` and `σ_y` along the tangents +x and +y; not for `RadianceSampled`.
    Two,
}

/// A parameter as fitted.
///
/// ```
/// use lobes::reflectance::fit::Estimate;
/// let sigma = Estimate { value: 0.1, standard_error: 0.002 };
/// println!("σ = {:.3} ± {:.3}", sigma.value, sigma.standard_error);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard error, from the residuals' scatter and the model's slopes: right where the
    /// noise is the same for every weighted residual and independent from one to the next.
    pub standard_error: f64,
}

/// What a fit found.
///
/// ```
/// # use lobes::glam::DVec3;
/// # use lobes::reflectance::{Variant, Ward, fit::{fit, residuals, Measurement, Widths}};
/// # let lobe = Ward::isotropic(Variant::Duer, 0.1)?;
/// # let view = DVec3::new(0.6, 0.0, 0.8);
/// # let measurements: Vec<_> = (0..50).map(|i| {
/// #     let angle = 0.03 * f64::from(i) - 0.1;
/// #     let light = DVec3::new(-angle.sin(), 0.0, angle.cos());
/// #     let value = 0.2 / std::f64::consts::PI + 0.3 * lobe.evaluate(view, light) / light.z;
/// #     Measurement { light, view, value, weight: 1.0 }
/// # }).collect();
/// // `measurements` are exact values of ρ_d = 0.2, ρ_s = 0.3 and σ = 0.1.
/// let found = fit(&measurements, Variant::Duer, Widths::One)?;
/// assert!((found.diffuse.value - 0.2).abs() < 1e-8 && (found.specular.value - 0.3).abs() < 1e-8);
/// assert!(found.residual < 1e-8);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Fit {
    /// Which lobe.
    pub variant: Variant,
    /// `ρ_d`. Not held to be positive: a negative one says that the lobe does not describe the
    /// surface.
    pub diffuse: Estimate,
    /// `ρ_s`; as for `ρ_d`.
    pub specular: Estimate,
    /// `σ_x` and `σ_y`; the same twice for one width.
    pub sigma: [Estimate; 2],
    /// √(Σ w `cos²θ_i` (f − value)² / Σ w).
    pub residual: f64,
    /// How many measurements.
    pub measurements: usize,
    /// How many steps Levenberg and Marquardt's method took.
    pub steps: usize,
}

/// A measurement's place and residual, for a plot.
///
/// ```
/// # use lobes::glam::DVec3;
/// # use lobes::reflectance::{Variant, Ward, fit::{fit, residuals, Measurement, Widths}};
/// # let lobe = Ward::isotropic(Variant::Duer, 0.1)?;
/// # let view = DVec3::new(0.6, 0.0, 0.8);
/// # let measurements: Vec<_> = (0..50).map(|i| {
/// #     let angle = 0.03 * f64::from(i) - 0.1;
/// #     let light = DVec3::new(-angle.sin(), 0.0, angle.cos());
/// #     let value = 0.2 / std::f64::consts::PI + 0.3 * lobe.evaluate(view, light) / light.z;
/// #     Measurement { light, view, value, weight: 1.0 }
/// # }).collect();
/// let found = fit(&measurements, Variant::Duer, Widths::One)?;
/// let points = residuals(&measurements, &found)?;
/// // Where the highlight is: the half vector along the normal.
/// let top = points.iter().min_by(|a, b| a.delta.total_cmp(&b.delta)).unwrap();
/// assert!((top.measured - top.fitted).abs() < 1e-8);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// The angle δ from the normal to the half vector, in radians.
    pub delta: f64,
    /// cos `θ_i` times the value.
    pub measured: f64,
    /// cos `θ_i` times the model.
    pub fitted: f64,
}

/// The steps that Levenberg and Marquardt's method may take.
const MOST_STEPS: usize = 200;

/// Fits a lobe by least squares.
///
/// For one σ the two albedos are a linear problem: σ is scanned from 0.002 to 1, and from the best
/// three unknowns (`ρ_d`, `ρ_s`, ln σ) are refined together (Levenberg 1944, Marquardt 1963,
/// [doi:10.1137/0111030](https://doi.org/10.1137/0111030)); for two widths, four.
///
/// # Errors
/// [`Error::Undetermined`] if the measurements do not determine the parameters: no light near the
/// mirror direction, no highlight that is twice its standard error, a σ at the end of its domain;
/// [`Error::TooFew`] if there are fewer than five, or if the method does not settle;
/// [`Error::Domain`] if a direction is not a unit vector above the horizon or a weight is negative;
/// [`Error::NotFinite`] if a value is not finite.
///
/// ```
/// use lobes::glam::DVec3;
/// use lobes::reflectance::{Variant, Ward, fit::{fit, Measurement, Widths}};
/// let lobe = Ward::isotropic(Variant::Duer, 0.1)?;
/// let view = DVec3::new(0.6, 0.0, 0.8);
/// let measurements: Vec<_> = (0..50).map(|i| {
///     let angle = 0.03 * f64::from(i) - 0.1;
///     let light = DVec3::new(-angle.sin(), 0.0, angle.cos());
///     let value = 0.2 / std::f64::consts::PI + 0.3 * lobe.evaluate(view, light) / light.z;
///     Measurement { light, view, value, weight: 1.0 }
/// }).collect();
/// let found = fit(&measurements, Variant::Duer, Widths::One)?;
/// assert!((found.sigma[0].value - 0.1).abs() < 1e-9);
/// # Ok::<(), lobes::Error>(())
/// ```
pub fn fit(measurements: &[Measurement], variant: Variant, widths: Widths) -> Result<Fit> {
    check(measurements)?;
    let mut best = None;
    for index in 0..48 {
        let sigma = 0.002 * 500f64.powf(f64::from(index) / 47.0);
        let problem = Problem::new(measurements, variant, [sigma, sigma])?;
        if let Some((diffuse, specular, sum)) = problem.albedos()
            && best.is_none_or(|(_, _, _, least)| sum < least)
        {
            best = Some((diffuse, specular, sigma, sum));
        }
    }
    let Some((diffuse, specular, sigma, _)) = best else {
        return Err(undetermined());
    };
    let mut parameters = vec![diffuse, specular, sigma.ln()];
    if widths == Widths::Two {
        parameters.push(sigma.ln());
    }
    refine(measurements, variant, parameters)
}

/// The measurements beside the model, each times cos `θ_i`, in their order.
///
/// # Errors
/// As [`fit`], and [`Error::Domain`] if the fitted σ is not in the domain of a lobe.
pub fn residuals(measurements: &[Measurement], fit: &Fit) -> Result<Vec<Residual>> {
    check(measurements)?;
    let [x, y] = fit.sigma.map(|sigma| sigma.value);
    let problem = Problem::new(measurements, fit.variant, [x, y])?;
    Ok(measurements
        .iter()
        .zip(&problem.lobe)
        .map(|(m, lobe)| {
            let half = m.light + m.view;
            Residual {
                delta: half.x.hypot(half.y).atan2(half.z),
                measured: m.light.z * m.value,
                fitted: fit.diffuse.value * FRAC_1_PI * m.light.z + fit.specular.value * lobe,
            }
        })
        .collect())
}

fn undetermined() -> Error {
    Error::Undetermined {
        parameter: "at least one of ρ_d, ρ_s and σ",
        reason: "others make up for it; add lights near the mirror direction and away from it",
    }
}

/// Why a fit that settled does not tell what the lobe is like, if it does not.
fn check_determined(
    measurements: &[Measurement],
    parameters: &[f64],
    lobe: &[f64],
    specular: Estimate,
) -> Result<()> {
    /// The least share of the lobe in the rms of the data: less is rounding.
    const SHARE: f64 = 1e-6;
    /// In standard errors: a lobe of no strength looks stronger once in twenty tables.
    const SIGNIFICANT: f64 = 2.0;
    let (mut of_lobe, mut of_data) = (0.0, 0.0);
    for (m, lobe) in measurements.iter().zip(lobe) {
        of_lobe += m.weight * (specular.value * lobe).powi(2);
        of_data += m.weight * (m.light.z * m.value).powi(2);
    }
    // Not >=, for NaN.
    if !(of_lobe.sqrt() >= SHARE * of_data.sqrt())
        || specular.value.abs() < SIGNIFICANT * specular.standard_error
    {
        return Err(Error::Undetermined {
            parameter: "the width σ of the lobe",
            reason: "no highlight stands out of the rest; add lights near the mirror direction, or take the surface for matte",
        });
    }
    if parameters[2..].iter().any(|width| *width > -1e-9) {
        return Err(Error::Undetermined {
            parameter: "the width σ of the lobe",
            reason: "the widest lobe there is, σ = 1, still fits best; add lights away from the mirror direction, or take another lobe",
        });
    }
    if parameters[2..]
        .iter()
        .any(|width| *width < MIN_SIGMA.ln() + 1e-9)
    {
        return Err(Error::Undetermined {
            parameter: "the width σ of the lobe",
            reason: "the narrowest lobe there is, σ = 0.000001, still fits best; add lights within the highlight, or take the surface for a mirror",
        });
    }
    Ok(())
}

fn check(measurements: &[Measurement]) -> Result<()> {
    if measurements.len() < 5 {
        return Err(Error::TooFew {
            what: "the fit of a lobe",
            items: "measurements",
            needed: 5,
            got: measurements.len(),
        });
    }
    for (index, m) in measurements.iter().enumerate() {
        for direction in [m.light, m.view] {
            if !visible(direction) {
                return Err(Error::Domain {
                    what: "the cosine of a measured direction with the normal",
                    value: direction.z,
                    allowed: "that of a unit vector above the horizon",
                });
            }
        }
        if !m.value.is_finite() {
            return Err(Error::NotFinite {
                what: "the measured reflectance",
                index,
                value: m.value,
            });
        }
        if !(m.weight >= 0.0 && m.weight.is_finite()) {
            return Err(Error::Domain {
                what: "the weight of a measurement",
                value: m.weight,
                allowed: "finite and at least 0",
            });
        }
    }
    Ok(())
}

/// The lobe's values, `f c_i`, at the measurements.
struct Problem<'a> {
    measurements: &'a [Measurement],
    lobe: Vec<f64>,
}

impl<'a> Problem<'a> {
    fn new(measurements: &'a [Measurement], variant: Variant, sigma: [f64; 2]) -> Result<Self> {
        let lobe = Ward::anisotropic(variant, sigma[0], sigma[1])?;
        Ok(Self {
            measurements,
            lobe: measurements
                .iter()
                .map(|m| lobe.evaluate(m.view, m.light))
                .collect(),
        })
    }

    /// The albedos that fit best, and the sum of squares that they leave.
    fn albedos(&self) -> Option<(f64, f64, f64)> {
        let (mut dd, mut ds, mut ss, mut dv, mut sv, mut vv) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for (m, &s) in self.measurements.iter().zip(&self.lobe) {
            let (d, v) = (m.light.z * FRAC_1_PI, m.light.z * m.value);
            dd += m.weight * d * d;
            ds += m.weight * d * s;
            ss += m.weight * s * s;
            dv += m.weight * d * v;
            sv += m.weight * s * v;
            vv += m.weight * v * v;
        }
        let determinant = dd * ss - ds * ds;
        // The angle between the two columns is resolved.
        (determinant > 1e-12 * dd * ss).then(|| {
            let diffuse = (ss * dv - ds * sv) / determinant;
            let specular = (dd * sv - ds * dv) / determinant;
            (diffuse, specular, vv - diffuse * dv - specular * sv)
        })
    }
}

/// The residuals `√w (cos θ_i f − cos θ_i value)` of `(ρ_d, ρ_s, ln σ)` or `(ρ_d, ρ_s, ln σ_x, ln
/// σ_y)`.
fn residual_vector(
    measurements: &[Measurement],
    variant: Variant,
    parameters: &[f64],
) -> Result<DVector<f64>> {
    let problem = Problem::new(measurements, variant, widths_of(parameters))?;
    Ok(DVector::from_iterator(
        measurements.len(),
        measurements.iter().zip(&problem.lobe).map(|(m, lobe)| {
            let model = parameters[0] * FRAC_1_PI * m.light.z + parameters[1] * lobe;
            m.weight.sqrt() * (model - m.light.z * m.value)
        }),
    ))
}

fn widths_of(parameters: &[f64]) -> [f64; 2] {
    let x = parameters[2].exp();
    [x, parameters.get(3).map_or(x, |y| y.exp())]
}

fn jacobian(
    measurements: &[Measurement],
    variant: Variant,
    parameters: &[f64],
) -> Result<DMatrix<f64>> {
    /// The step of the central difference in ln σ: its error is of the order of its square.
    const STEP: f64 = 1e-5;
    let problem = Problem::new(measurements, variant, widths_of(parameters))?;
    let mut jacobian = DMatrix::zeros(measurements.len(), parameters.len());
    for (row, (m, lobe)) in measurements.iter().zip(&problem.lobe).enumerate() {
        jacobian[(row, 0)] = m.weight.sqrt() * FRAC_1_PI * m.light.z;
        jacobian[(row, 1)] = m.weight.sqrt() * lobe;
    }
    for column in 2..parameters.len() {
        // One-sided where the domain of σ ends.
        let (low, high) = (
            (parameters[column] - STEP).max(MIN_SIGMA.ln()),
            (parameters[column] + STEP).min(0.0),
        );
        let mut moved = parameters.to_vec();
        moved[column] = high;
        let above = Problem::new(measurements, variant, widths_of(&moved))?;
        moved[column] = low;
        let below = Problem::new(measurements, variant, widths_of(&moved))?;
        for (row, m) in measurements.iter().enumerate() {
            let slope = (above.lobe[row] - below.lobe[row]) / (high - low);
            jacobian[(row, column)] = m.weight.sqrt() * parameters[1] * slope;
        }
    }
    Ok(jacobian)
}

fn refine(measurements: &[Measurement], variant: Variant, start: Vec<f64>) -> Result<Fit> {
    let mut parameters = start;
    let mut residual = residual_vector(measurements, variant, &parameters)?;
    let mut sum = residual.norm_squared();
    let mut damping = 1e-3;
    for steps in 0..MOST_STEPS {
        let slopes = jacobian(measurements, variant, &parameters)?;
        let normal = slopes.tr_mul(&slopes);
        let gradient = slopes.tr_mul(&residual);
        loop {
            let mut damped = normal.clone();
            for k in 0..parameters.len() {
                damped[(k, k)] *= 1.0 + damping;
            }
            let Some(step) = damped.cholesky().map(|c| c.solve(&gradient)) else {
                return Err(undetermined());
            };
            let mut moved: Vec<f64> = parameters.iter().zip(&step).map(|(p, s)| p - s).collect();
            for width in &mut moved[2..] {
                *width = width.clamp(MIN_SIGMA.ln() + 1e-12, 0.0);
            }
            let moved_residual = residual_vector(measurements, variant, &moved)?;
            let moved_sum = moved_residual.norm_squared();
            let shift = moved
                .iter()
                .zip(&parameters)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            let better = moved_sum < sum;
            if better {
                (parameters, residual, sum) = (moved, moved_residual, moved_sum);
                damping = (damping * 0.1).max(1e-12);
            } else {
                damping *= 10.0;
            }
            // Settled: the step is lost in rounding, or no step is any better.
            if shift < 1e-12 || damping > 1e12 {
                return finish(measurements, variant, &parameters, &normal, sum, steps);
            }
            if better {
                break;
            }
        }
    }
    Err(Error::NotConverged {
        what: "the fit of the lobe",
        steps: MOST_STEPS,
    })
}

fn finish(
    measurements: &[Measurement],
    variant: Variant,
    parameters: &[f64],
    normal: &DMatrix<f64>,
    sum: f64,
    steps: usize,
) -> Result<Fit> {
    let degrees_of_freedom = (measurements.len() - parameters.len()) as f64;
    // Scaled to a unit diagonal: whether a matrix is singular must not depend on units.
    let scale: Vec<f64> = (0..parameters.len())
        .map(|k| normal[(k, k)].sqrt())
        .collect();
    let scaled = DMatrix::from_fn(scale.len(), scale.len(), |i, j| {
        normal[(i, j)] / (scale[i] * scale[j])
    });
    let smallest = scaled
        .clone()
        .symmetric_eigen()
        .eigenvalues
        .iter()
        .copied()
        .fold(f64::INFINITY, f64::min);
    let inverse = match scaled.try_inverse() {
        Some(inverse) if smallest > 1e-12 => inverse,
        _ => return Err(undetermined()),
    };
    let estimate = |k: usize| Estimate {
        value: parameters[k],
        standard_error: (inverse[(k, k)] * sum / degrees_of_freedom).sqrt() / scale[k],
    };
    let width = |k: usize| {
        let log = estimate(k);
        Estimate {
            value: log.value.exp(),
            standard_error: log.value.exp() * log.standard_error,
        }
    };
    let weights: f64 = measurements.iter().map(|m| m.weight).sum();
    let problem = Problem::new(measurements, variant, widths_of(parameters))?;
    check_determined(measurements, parameters, &problem.lobe, estimate(1))?;
    Ok(Fit {
        variant,
        diffuse: estimate(0),
        specular: estimate(1),
        sigma: [width(2), width(parameters.len() - 1)],
        residual: (sum / weights).sqrt(),
        measurements: measurements.len(),
        steps,
    })
}

/// What is wrong with a table of measurements, before it is known which file it is.
struct Unreadable {
    problem: String,
    remedy: &'static str,
}

impl Unreadable {
    fn in_file(self, path: &Path) -> Error {
        Error::file(path, self.problem, self.remedy)
    }

    fn in_bytes(self) -> Error {
        Error::Contents {
            problem: self.problem,
            remedy: self.remedy.into(),
        }
    }
}

/// Reads measurements from a table of comma-separated `theta_i, phi_i, theta_o, phi_o, value`,
/// angles in degrees.
///
/// θ is from the normal and φ about it from the tangent +x. Empty lines and lines that begin with
/// `#` are skipped, and so is a first line of five names, none of which is a number or begins with
/// a digit. A byte order mark is no part of the first field. Each measurement has weight 1.
///
/// # Errors
/// [`Error::File`] if the file cannot be read or a line, which it names, is not five numbers, lies
/// below the horizon or has a negative value.
#[cfg(feature = "files")]
pub fn read_csv(path: &Path) -> Result<Vec<Measurement>> {
    let bytes = std::fs::read(path)
        .map_err(|error| Error::file(path, error.to_string(), "give a readable file"))?;
    csv(&bytes).map_err(|problem| problem.in_file(path))
}

/// [`read_csv`], of text in memory.
///
/// # Errors
/// [`Error::Contents`] if a line, which it names, is not five numbers, lies below the horizon or
/// has a negative value.
#[cfg(feature = "files")]
pub fn parse_csv(text: &str) -> Result<Vec<Measurement>> {
    csv(text.as_bytes()).map_err(Unreadable::in_bytes)
}

#[cfg(feature = "files")]
fn csv(bytes: &[u8]) -> std::result::Result<Vec<Measurement>, Unreadable> {
    let fail = |number: u64, problem: &str| Unreadable {
        problem: format!("line {number} {problem}"),
        remedy: "each line is theta_i, phi_i, theta_o, phi_o, value, with angles in degrees and thetas below 90",
    };
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(bytes);
    let mut measurements = Vec::new();
    let mut first = true;
    let mut record = csv::StringRecord::new();
    loop {
        let before = reader.position().line();
        match reader.read_record(&mut record) {
            Ok(true) => {}
            Ok(false) => return Ok(measurements),
            Err(error) => {
                let line = error.position().map_or(before, csv::Position::line);
                return Err(fail(line, "is not UTF-8 text"));
            }
        }
        let number = record.position().map_or(before, csv::Position::line);
        if record.iter().all(str::is_empty) {
            continue;
        }
        if record.len() != 5 {
            let fields = if record.len() == 1 { "field" } else { "fields" };
            let problem = format!("has {} {fields} where 5 are needed", record.len());
            return Err(fail(number, &problem));
        }
        let is_name =
            |field: &str| field.starts_with(char::is_alphabetic) && field.parse::<f64>().is_err();
        if std::mem::take(&mut first) && record.iter().all(is_name) {
            continue;
        }
        let mut fields = [0.0f64; 5];
        for (value, field) in fields.iter_mut().zip(&record) {
            *value = field
                .parse()
                .map_err(|_| fail(number, &format!("is not numbers: \"{}\"", short(field))))?;
        }
        if !fields.iter().all(|field| field.is_finite()) {
            return Err(fail(number, "holds a number that is not finite"));
        }
        let [theta_i, phi_i, theta_o, phi_o, value] = fields;
        let above = |theta: f64| (0.0..90.0).contains(&theta);
        if !(above(theta_i) && above(theta_o)) {
            return Err(fail(number, "has a direction below the horizon"));
        }
        if value < 0.0 {
            return Err(fail(
                number,
                "has a negative value, which no reflectance is; leave out what was not measured",
            ));
        }
        measurements.push(Measurement {
            light: direction(theta_i, phi_i),
            view: direction(theta_o, phi_o),
            value,
            weight: 1.0,
        });
    }
}

/// The beginning of a field, for a message.
#[cfg(feature = "files")]
fn short(field: &str) -> String {
    field.chars().take(20).collect()
}

#[cfg(feature = "files")]
fn direction(theta: f64, phi: f64) -> DVec3 {
    let (sin_theta, cos_theta) = theta.to_radians().sin_cos();
    let (sin_phi, cos_phi) = phi.to_radians().sin_cos();
    DVec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
}

/// The three channels of MERL's format, and by what its integers are scaled.
const MERL_SCALES: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];
/// Its cells over `θ_h` (uniform in the root), `θ_d` and `φ_d` (half a turn).
const MERL_CELLS: [usize; 3] = [90, 90, 180];

/// Reads one channel (0 red, 1 green, 2 blue) of a `.binary` file of the MERL database (Matusik,
/// Pfister, Brand and McMillan 2003, *A Data-Driven Reflectance Model*,
/// [doi:10.1145/882262.882343](https://doi.org/10.1145/882262.882343)).
///
/// A cell stands for its centre in (`θ_h`, `θ_d`, `φ_d`) and counts its share of `dω_i` `dω_o` = 4
/// cos `θ_d` `dω_h` `dω_d`. Cells that hold a negative number (not measured) or lie below the
/// horizon are left out.
///
/// # Errors
/// [`Error::File`] if the file cannot be read or does not have the format's 90 × 90 × 180 cells;
/// [`Error::Domain`] if the channel is not 0, 1 or 2.
pub fn read_merl(path: &Path, channel: usize) -> Result<Vec<Measurement>> {
    let scale = merl_scale(channel)?;
    let bytes = std::fs::read(path).map_err(|error| not_merl(error.to_string()).in_file(path))?;
    merl(&bytes, channel, scale).map_err(|problem| problem.in_file(path))
}

/// [`read_merl`], of bytes in memory.
///
/// # Errors
/// [`Error::Contents`] if the bytes are not the format's 90 × 90 × 180 cells; [`Error::Domain`] if
/// the channel is not 0, 1 or 2.
pub fn parse_merl(bytes: &[u8], channel: usize) -> Result<Vec<Measurement>> {
    merl(bytes, channel, merl_scale(channel)?).map_err(Unreadable::in_bytes)
}

fn merl_scale(channel: usize) -> Result<f64> {
    MERL_SCALES.get(channel).copied().ok_or(Error::Domain {
        what: "the channel of a MERL file",
        value: channel as f64,
        allowed: "0, 1 or 2",
    })
}

fn not_merl(problem: String) -> Unreadable {
    Unreadable {
        problem,
        remedy: "give a .binary file of the MERL database, 90 × 90 × 180 cells",
    }
}

fn merl(
    bytes: &[u8],
    channel: usize,
    scale: f64,
) -> std::result::Result<Vec<Measurement>, Unreadable> {
    let cells: usize = MERL_CELLS.iter().product();
    if bytes.len() != 12 + 24 * cells {
        return Err(not_merl(format!("has {} bytes", bytes.len())));
    }
    let (header, values) = bytes.split_at(12);
    let (sizes, _) = header.as_chunks::<4>();
    for (size, want) in sizes.iter().zip(MERL_CELLS) {
        let got = i32::from_le_bytes(*size);
        if got != want as i32 {
            return Err(not_merl(format!("has {got} cells where {want} are needed")));
        }
    }
    let (values, _) = values.as_chunks::<8>();
    let values = &values[channel * cells..][..cells];
    let mut measurements = Vec::new();
    for (index, value) in values.iter().enumerate() {
        let value = f64::from_le_bytes(*value);
        if !value.is_finite() {
            return Err(not_merl(format!("holds {value} in cell {index}")));
        }
        if value < 0.0 {
            continue;
        }
        let theta_h = FRAC_PI_2 * ((index / (180 * 90)) as f64 + 0.5).powi(2) / 8100.0;
        let theta_d = FRAC_PI_2 * ((index / 180 % 90) as f64 + 0.5) / 90.0;
        let phi_d = PI * ((index % 180) as f64 + 0.5) / 180.0;
        let (sin_h, cos_h) = theta_h.sin_cos();
        let (sin_d, cos_d) = theta_d.sin_cos();
        let (x, y) = (sin_d * phi_d.cos(), sin_d * phi_d.sin());
        // The half vector lies in the plane of the normal and +x.
        let light = DVec3::new(cos_h * x + sin_h * cos_d, y, cos_h * cos_d - sin_h * x);
        let view = DVec3::new(sin_h * cos_d - cos_h * x, -y, cos_h * cos_d + sin_h * x);
        if light.z <= HORIZON || view.z <= HORIZON {
            continue;
        }
        // dθ_h of cells that are uniform in the root of θ_h.
        let width_h = PI * ((index / (180 * 90)) as f64 + 0.5) / 8100.0;
        measurements.push(Measurement {
            light,
            view,
            value: value * scale,
            weight: 4.0 * cos_d * sin_d * sin_h * width_h,
        });
    }
    Ok(measurements)
}
