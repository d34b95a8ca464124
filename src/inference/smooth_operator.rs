//! The operator of a view over smooth functions across its rings, in which evidence is taken.

use nalgebra::DMatrix;

use super::bright_lights::BrightLights;
use crate::error::check_length;
use crate::features::{Modes, RingLayout, cosine_basis};
use crate::harmonics::legendre;
use crate::reflection::Operator;
use crate::{Error, Result};

/// An [`Operator`] whose rings are summed with the first cosines across them.
///
/// What is left of light of high degrees, which a mirror shows and the operator's degree cuts off,
/// lies between the rings more than along them: smooth functions do not see it.
///
/// ```
/// use lobes::inference::SmoothOperator;
/// # use lobes::{Parallelism, reflectance::Variant, reflection::{Operator, Viewpoint}};
/// # use lobes::features::{Modes, RingLayout};
/// # let layout = RingLayout::new(Viewpoint::Orthographic, 12, 4)?;
/// # let one = Parallelism::Sequential;
/// # let operator = Operator::new(Variant::Duer, 0.1, Viewpoint::Orthographic, layout.angles(), 16, one)?;
/// let smooth = SmoothOperator::new(&operator, &layout)?;
/// assert_eq!(smooth.degree(), operator.degree());
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct SmoothOperator {
    degree: usize,
    /// By order: a row a function, a column a degree from the order on.
    diffuse: Vec<DMatrix<f64>>,
    specular: Vec<DMatrix<f64>>,
}

/// The amplitudes of one channel of a picture over the same functions: by order, one column
/// (cosine) or two (cosine and sine).
///
/// ```
/// use lobes::inference::SmoothModes;
/// # use lobes::{Parallelism, reflectance::Variant, reflection::{Operator, Viewpoint}};
/// # use lobes::features::{Modes, RingLayout};
/// # let layout = RingLayout::new(Viewpoint::Orthographic, 12, 4)?;
/// # let one = Parallelism::Sequential;
/// # let operator = Operator::new(Variant::Duer, 0.1, Viewpoint::Orthographic, layout.angles(), 16, one)?;
/// let amplitudes = Modes::from_values(&layout, vec![1.0; layout.len()])?;
/// let smooth = SmoothModes::new(&amplitudes, &layout)?;
/// // Modes of another layout are refused.
/// let other = RingLayout::new(Viewpoint::Orthographic, 10, 4)?;
/// assert!(SmoothModes::new(&amplitudes, &other).is_err());
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct SmoothModes {
    pub(super) orders: Vec<DMatrix<f64>>,
}

/// What lights of strength 1 in some directions give a diffuse and a specular sphere: by order, a
/// row a function, a column a light at azimuth 0.
///
/// ```
/// use lobes::inference::{BrightLights, GaussianEvidence, SmoothModes, SmoothOperator, natural_spectrum};
/// # use lobes::{Parallelism, reflectance::Variant, reflection::{Operator, Viewpoint}};
/// # use lobes::features::{Modes, RingLayout};
/// # let layout = RingLayout::new(Viewpoint::Orthographic, 12, 4)?;
/// # let one = Parallelism::Sequential;
/// # let operator = Operator::new(Variant::Duer, 0.1, Viewpoint::Orthographic, layout.angles(), 16, one)?;
/// let smooth = SmoothOperator::new(&operator, &layout)?;
/// // What a small light half a radian from the line of sight adds to the rings' amplitudes.
/// let lamp = smooth.responses(&BrightLights::from_directions(vec![(0.5, 0.0)]))?;
/// let evidence = GaussianEvidence::new(&smooth, &natural_spectrum(0.5, 16), 0.5, 0.5, 1e-2)?;
/// let modes = SmoothModes::new(&Modes::from_values(&layout, vec![1.0; layout.len()])?, &layout)?;
/// assert!(evidence.of(&modes, &lamp)?.log.is_finite());
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct LightResponses {
    /// By order: sin mφ and cos mφ of each light.
    pub(super) waves: Vec<Vec<(f64, f64)>>,
    pub(super) diffuse: Vec<DMatrix<f64>>,
    pub(super) specular: Vec<DMatrix<f64>>,
}

/// Functions across the rings, or as many as there are rings.
const FUNCTIONS: usize = 24;

fn basis(layout: &RingLayout) -> DMatrix<f64> {
    let rings = layout.angles().len();
    cosine_basis(rings, FUNCTIONS.min(rings))
}

impl SmoothModes {
    /// The amplitudes of a picture that was read on `layout`.
    ///
    /// # Errors
    /// [`Error::Length`] for modes of another layout.
    pub fn new(modes: &Modes, layout: &RingLayout) -> Result<Self> {
        let rings = layout.angles().len();
        modes.check(layout)?;
        let basis = basis(layout).transpose();
        let orders = (0..=layout.orders())
            .map(|m| {
                let columns = if m == 0 { 1 } else { 2 };
                let both = modes.cosine(m).iter().chain(modes.sine(m)).copied();
                &basis * DMatrix::from_iterator(rings, columns, both)
            })
            .collect();
        Ok(Self { orders })
    }
}

impl SmoothOperator {
    /// The orders of `layout`, whose rings are those of the operator.
    ///
    /// # Errors
    /// [`Error::Length`] for an operator at other rings; an order past its degree.
    pub fn new(operator: &Operator, layout: &RingLayout) -> Result<Self> {
        let rings = layout.angles().len();
        check_length("the rings of the operator", rings, operator.rings().len())?;
        let basis = basis(layout).transpose();
        let part = |rho_d: f64, rho_s: f64| {
            (0..=layout.orders())
                .map(|m| Ok(&basis * operator.block(m, rho_d, rho_s)?))
                .collect::<Result<Vec<_>>>()
        };
        Ok(Self {
            degree: operator.degree(),
            diffuse: part(1.0, 0.0)?,
            specular: part(0.0, 1.0)?,
        })
    }

    /// The largest degree of the light.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// `ρ_d T^d + ρ_s T^s` of each order.
    pub(super) fn blocks(&self, rho_d: f64, rho_s: f64) -> impl Iterator<Item = DMatrix<f64>> {
        self.diffuse
            .iter()
            .zip(&self.specular)
            .map(move |(diffuse, specular)| diffuse * rho_d + specular * rho_s)
    }

    /// What small lights in these directions give.
    ///
    /// # Errors
    /// None that a caller can cause.
    pub fn responses(&self, lights: &BrightLights) -> Result<LightResponses> {
        let directions = lights.directions();
        let (mut diffuse, mut specular) = (Vec::new(), Vec::new());
        for (m, (of_diffuse, of_specular)) in self.diffuse.iter().zip(&self.specular).enumerate() {
            let degrees = self.degree + 1 - m;
            let mut harmonics = DMatrix::zeros(degrees, directions.len());
            let mut column = vec![0.0; degrees];
            for (light, (polar, _)) in directions.iter().enumerate() {
                let (sin, cos) = polar.sin_cos();
                legendre::column(m, self.degree, cos, sin, &mut column)?;
                harmonics.column_mut(light).copy_from_slice(&column);
            }
            diffuse.push(of_diffuse * &harmonics);
            specular.push(of_specular * &harmonics);
        }
        Ok(LightResponses {
            waves: (0..self.diffuse.len())
                .map(|m| {
                    let azimuths = directions.iter().map(|direction| direction.1);
                    azimuths
                        .map(|azimuth| (m as f64 * azimuth).sin_cos())
                        .collect()
                })
                .collect(),
            diffuse,
            specular,
        })
    }
}

impl LightResponses {
    /// How many lights.
    pub(super) fn count(&self) -> usize {
        self.waves.first().map_or(0, Vec::len)
    }

    /// Whether they are of an operator of so many orders and functions.
    pub(super) fn check(&self, orders: usize, functions: usize) -> Result<()> {
        check_length("the responses to lights", orders, self.diffuse.len())?;
        match self.diffuse.first() {
            Some(first) if first.nrows() != functions => Err(Error::Length {
                what: "a response to a light",
                expected: functions,
                got: first.nrows(),
            }),
            _ => Ok(()),
        }
    }
}
