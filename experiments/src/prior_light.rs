//! Pictures of light drawn from the model's own prior, and how often the posterior of the light
//! holds it.

use lobes::features::{Modes, RingLayout};
use lobes::harmonics::{Coefficients, legendre};
use lobes::inference::{BrightLights, ChannelReflectance, LightReader, natural_spectrum};
use lobes::reflectance::Variant;
use lobes::reflection::{Operator, Viewpoint};
use lobes::{Parallelism, Result};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::known_light::{KnownBall, degree_shown};

/// Rings, orders and degree of these pictures. As many rings as there are smooth functions, so that
/// white noise on rings is white in them too.
pub(crate) const RINGS: usize = 24;
pub(crate) const ORDERS: usize = 16;
pub(crate) const DEGREE: usize = 48;

/// ν.
pub(crate) const NOISE: f64 = 1e-2;

/// τ², as the evidence and the reader of light have it.
const LAMPS: f64 = 100.0;

/// The polar angles and the azimuths of the lamps.
pub(crate) const DIRECTIONS: [(f64, f64); 2] = [(0.6, 0.4), (1.3, -2.0)];

fn deviate(rng: &mut Pcg64) -> f64 {
    let (u, v): (f64, f64) = (rng.random(), rng.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// One draw: light of a Gaussian field and two lamps, and the picture of a ball in it with noise.
pub(crate) struct PriorDraw {
    pub(crate) modes: Modes,
    light: Coefficients,
}

impl PriorDraw {
    /// Of light of power `power` per order, and of a strength; of orders that are not seen the light
    /// has nothing but the lamps.
    pub(crate) fn new(
        operator: &Operator,
        layout: &RingLayout,
        power: &[f64],
        [rho_d, rho_s]: [f64; 2],
        strength: f64,
        rng: &mut Pcg64,
    ) -> Result<Self> {
        let mut total = 0.0;
        for m in 1..=ORDERS {
            total += operator.covariance(m, power, rho_d, rho_s)?.trace();
        }
        let white = NOISE * (total / (ORDERS * RINGS) as f64).sqrt();
        let fluxes = DIRECTIONS.map(|_| LAMPS.sqrt() * deviate(rng));
        let mut light = Coefficients::zeros(DEGREE);
        let mut values = Vec::with_capacity(layout.len());
        for m in 0..=ORDERS {
            let block = operator.block(m, rho_d, rho_s)?;
            for part in 0..if m == 0 { 1 } else { 2 } {
                let mut own: Vec<f64> = power[m..]
                    .iter()
                    .map(|power| power.sqrt() * deviate(rng))
                    .collect();
                for ((polar, azimuth), flux) in DIRECTIONS.iter().zip(fluxes) {
                    let mut column = vec![0.0; own.len()];
                    let (sin, cos) = f64::sin_cos(*polar);
                    legendre::column(m, DEGREE, cos, sin, &mut column)?;
                    let (sin, cos) = (m as f64 * azimuth).sin_cos();
                    let wave = if part == 0 { cos } else { sin };
                    for (own, value) in own.iter_mut().zip(column) {
                        *own += flux * wave * value;
                    }
                }
                for ring in 0..RINGS {
                    let row = block.row(ring);
                    let shown: f64 = row.iter().zip(&own).map(|(t, l)| t * l).sum();
                    values.push(strength.sqrt() * (shown + white * deviate(rng)));
                }
                let column = if part == 0 {
                    light.cosine_mut(m)
                } else {
                    light.sine_mut(m)
                };
                for (coefficient, own) in column.iter_mut().zip(own) {
                    *coefficient = strength.sqrt() * own;
                }
            }
        }
        Ok(Self {
            modes: Modes::from_values(layout, values)?,
            light,
        })
    }
}

/// χ² per degree of freedom of the light about a ball, over so many draws from the model's own prior:
/// the mean of ((L_lm − L̂_lm)/deviation)² over the orders that are seen and the degrees that the ball
/// shows.
///
/// # Errors
/// What the operator and the reader refuse.
pub fn prior_chi_square(ball: &KnownBall, draws: usize, parallelism: Parallelism) -> Result<f64> {
    let (lobe, view) = (Variant::default(), Viewpoint::Orthographic);
    let layout = RingLayout::new(view, RINGS, ORDERS)?;
    let ChannelReflectance {
        diffuse,
        specular,
        sigma,
    } = ball.reflectance;
    let mut power = natural_spectrum(0.5, DEGREE);
    // A spectrum that ends: no light is past the degree, and none is taken into account.
    power[DEGREE] = 0.0;
    let one = Parallelism::Sequential;
    let operator = Operator::new(lobe, sigma, view, layout.angles(), DEGREE, one)?;
    let reader = LightReader::new(lobe, ball.reflectance, &layout, &power, NOISE, parallelism)?;
    let lamps = BrightLights::from_directions(DIRECTIONS.to_vec());
    let shown = degree_shown(ball, DEGREE - 1);
    let squares = parallelism.map(draws, |draw| {
        let mut rng = Pcg64::seed_from_u64(2_000_003 + draw as u64);
        let strength = 10f64.powf(2.0 * rng.random::<f64>() - 1.0);
        let of = [diffuse, specular];
        let drawn = PriorDraw::new(&operator, &layout, &power, of, strength, &mut rng)?;
        let estimate = reader.read(&drawn.modes, &lamps)?;
        let (mut sum, mut count) = (0.0, 0.0);
        for l in 0..=shown {
            let most = l.min(ORDERS) as isize;
            for m in -most..=most {
                let off = estimate.mean.get(l, m) - drawn.light.get(l, m);
                sum += (off / reader.deviation(&estimate, l, m)?).powi(2);
                count += 1.0;
            }
        }
        Ok(sum / count)
    });
    let squares = squares.into_iter().collect::<Result<Vec<f64>>>()?;
    Ok(squares.iter().sum::<f64>() / draws as f64)
}
