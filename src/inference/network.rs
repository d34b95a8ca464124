//! A small convolutional network: its outputs, and how it learns.

use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::error::check_length;
use crate::{Error, Result};

/// A convolutional network for square pictures that are accompanied by a list of statistics.
///
/// Four convolutions of 3 × 3 pixels follow each other, each taken at every second pixel and
/// followed by a rectifier max(0, x), so that a picture of 64 pixels a side becomes 4 × 4 places of
/// 128 channels. The mean and the largest value of each channel and the statistics go through a dense
/// layer of 96 rectified units; a second dense layer gives the outputs. (The scheme is that of `LeNet`,
/// LeCun et al. 1998, doi:10.1109/5.726791; weights begin as He et al. 2015 draw them,
/// doi:10.1109/ICCV.2015.123.)
///
/// Numbers are `f32`. The order of summation is fixed but for that within a matrix product, which
/// the crate `matrixmultiply` chooses by the processor, so that outputs differ between processors by
/// rounding only.
///
/// ```
/// use lobes::inference::Network;
/// let network = Network::random(3, 2, 1);
/// let outputs = network.outputs(&vec![0.5; Network::INPUTS], &[0.0, 1.0, 2.0])?;
/// assert_eq!(outputs.len(), 2);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Weights (nine times the channels before × the channels after) and offsets.
    convolutions: Vec<Layer>,
    dense: Vec<Layer>,
}

#[derive(Debug, Clone, PartialEq)]
struct Layer {
    weights: DMatrix<f32>,
    offsets: Vec<f32>,
}

/// Channels after each convolution.
const CHANNELS: [usize; 4] = [32, 64, 96, 128];

/// Units of the hidden dense layer.
const HIDDEN: usize = 96;

/// What is kept of a picture on its way through, for the way back.
struct Trace {
    /// The neighbourhoods that each convolution saw, a row a place.
    neighbourhoods: Vec<DMatrix<f32>>,
    /// What each convolution gave, a row a place, after the rectifier.
    convolved: Vec<DMatrix<f32>>,
    /// What the first dense layer saw, and by what each of it had been multiplied.
    pooled: Vec<f32>,
    kept: Vec<f32>,
    /// Where each channel is largest.
    largest: Vec<usize>,
    hidden: Vec<f32>,
    outputs: Vec<f32>,
}

impl Layer {
    fn random(inputs: usize, outputs: usize, gain: f64, normal: &mut impl FnMut() -> f64) -> Self {
        let scale = gain * (2.0 / inputs as f64).sqrt();
        Self {
            weights: DMatrix::from_fn(inputs, outputs, |_, _| (scale * normal()) as f32),
            offsets: vec![0.0; outputs],
        }
    }

    /// The layer's outputs for a list of inputs.
    fn outputs(&self, inputs: &[f32]) -> Vec<f32> {
        let columns = self.weights.column_iter().zip(&self.offsets);
        columns
            .map(|(weights, offset)| {
                let products = weights.iter().zip(inputs).map(|(w, x)| w * x);
                offset + products.sum::<f32>()
            })
            .collect()
    }

    /// Adds to `gradient` that of a loss whose derivatives by the outputs are `by_outputs`; gives
    /// those by the inputs.
    fn backwards(&self, inputs: &[f32], by_outputs: &[f32], gradient: &mut Self) -> Vec<f32> {
        let mut by_inputs = vec![0.0; inputs.len()];
        for (column, &slope) in by_outputs.iter().enumerate() {
            if slope == 0.0 {
                continue;
            }
            gradient.offsets[column] += slope;
            let mut sums = gradient.weights.column_mut(column);
            let weights = self.weights.column(column);
            for (i, input) in inputs.iter().enumerate() {
                sums[i] += slope * input;
                by_inputs[i] += slope * weights[i];
            }
        }
        by_inputs
    }
}

/// Calls `visit` with the rows of one channel of a picture and of the list of neighbourhoods that
/// belong together: where pixel (2x + j) of the first is neighbour j of place x of the second.
fn neighbours(side: usize, mut visit: impl FnMut(usize, usize, usize, usize, usize)) {
    let half = side / 2;
    for i in 0..3 {
        for j in 0..3 {
            // A neighbour beyond the last row or column is 0.
            let places = if j == 2 { half - 1 } else { half };
            let rows = if i == 2 { half - 1 } else { half };
            for row in 0..rows {
                visit(3 * i + j, (2 * row + i) * side + j, row * half, places, 2);
            }
        }
    }
}

/// The 3 × 3 neighbours of every second pixel: column 9c + 3i + j is channel c moved by i rows and j
/// columns.
fn neighbourhoods(picture: &[f32], side: usize, channels: usize) -> DMatrix<f32> {
    let mut all = DMatrix::zeros(side * side / 4, 9 * channels);
    for channel in 0..channels {
        let plane = &picture[channel * side * side..][..side * side];
        neighbours(side, |which, from, to, places, step| {
            let mut column = all.column_mut(9 * channel + which);
            let column = &mut column.as_mut_slice()[to..to + places];
            for (value, pixel) in column.iter_mut().zip(plane[from..].iter().step_by(step)) {
                *value = *pixel;
            }
        });
    }
    all
}

/// The adjoint of [`neighbourhoods`]: a column a channel.
fn gathered(all: &DMatrix<f32>, side: usize, channels: usize) -> DMatrix<f32> {
    let mut picture = DMatrix::zeros(side * side, channels);
    for channel in 0..channels {
        let mut plane = picture.column_mut(channel);
        let plane = plane.as_mut_slice();
        neighbours(side, |which, to, from, places, step| {
            let column = all.column(9 * channel + which);
            let column = &column.as_slice()[from..from + places];
            for (pixel, value) in plane[to..].iter_mut().step_by(step).zip(column) {
                *pixel += value;
            }
        });
    }
    picture
}

impl Network {
    /// Pixels a side of a picture.
    pub const SIDE: usize = 64;

    /// Channels of a picture.
    pub const CHANNELS: usize = 4;

    /// Values of a picture: channel by channel, rows from the top, each from the left.
    pub const INPUTS: usize = Self::CHANNELS * Self::SIDE * Self::SIDE;

    /// A network that has learned nothing, for so many statistics and outputs, its weights drawn by
    /// Pcg64 from `seed`.
    pub fn random(statistics: usize, outputs: usize, seed: u64) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut normal = move || {
            let (u, v): (f64, f64) = (rng.random(), rng.random());
            (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
        };
        let mut inputs = Self::CHANNELS;
        let convolutions = CHANNELS.map(|channels| {
            let layer = Layer::random(9 * inputs, channels, 1.0, &mut normal);
            inputs = channels;
            layer
        });
        let dense = vec![
            Layer::random(2 * inputs + statistics, HIDDEN, 1.0, &mut normal),
            // Outputs that are small at first: no answer is preferred.
            Layer::random(HIDDEN, outputs, 0.3, &mut normal),
        ];
        Self {
            convolutions: convolutions.into(),
            dense,
        }
    }

    /// How many statistics go with a picture.
    pub fn statistics(&self) -> usize {
        self.dense[0].weights.nrows() - 2 * CHANNELS[CHANNELS.len() - 1]
    }

    /// All weights and offsets, layer by layer.
    pub fn parameters(&self) -> impl Iterator<Item = &[f32]> {
        let layers = self.convolutions.iter().chain(&self.dense);
        layers.flat_map(|layer| [layer.weights.as_slice(), &layer.offsets])
    }

    /// All weights and offsets, layer by layer, to be changed.
    pub fn parameters_mut(&mut self) -> impl Iterator<Item = &mut [f32]> {
        let layers = self.convolutions.iter_mut().chain(&mut self.dense);
        layers.flat_map(|layer| [layer.weights.as_mut_slice(), &mut layer.offsets])
    }

    /// A network of the same shape whose every number is 0: where gradients are summed.
    #[must_use]
    pub fn zeros(&self) -> Self {
        let mut zeros = self.clone();
        for numbers in zeros.parameters_mut() {
            numbers.fill(0.0);
        }
        zeros
    }

    /// The outputs for a picture of [`Self::INPUTS`] values and its statistics.
    ///
    /// # Errors
    /// [`Error::Length`] for another number of values or statistics.
    pub fn outputs(&self, picture: &[f32], statistics: &[f32]) -> Result<Vec<f32>> {
        self.check(picture, statistics)?;
        Ok(self.trace(picture, statistics, || 1.0).outputs)
    }

    fn check(&self, picture: &[f32], statistics: &[f32]) -> Result<()> {
        check_length("a network's picture", Self::INPUTS, picture.len())?;
        check_length(
            "the statistics of a network's picture",
            self.statistics(),
            statistics.len(),
        )
    }

    /// Adds to `gradient` that of a loss by the network's numbers, and gives the loss.
    ///
    /// `loss` gives the loss of some outputs and its derivative by each. One in five of what the
    /// first dense layer sees is left out, drawn by `rng` (dropout, Srivastava et al. 2014), and
    /// the others grow by 5/4, so that the network does not lean on any one of them.
    ///
    /// # Errors
    /// [`Error::Length`] for another number of values, statistics or derivatives than the network
    /// has, or a gradient of another shape, and what `loss` finds wrong.
    pub fn learn(
        &self,
        picture: &[f32],
        statistics: &[f32],
        gradient: &mut Self,
        rng: &mut Pcg64,
        loss: impl Fn(&[f32]) -> Result<(f32, Vec<f32>)>,
    ) -> Result<f32> {
        self.check(picture, statistics)?;
        check_length(
            "the numbers of a gradient",
            self.parameters().map(<[f32]>::len).sum(),
            gradient.parameters().map(<[f32]>::len).sum(),
        )?;
        let keep = || {
            if rng.random::<f32>() < 0.8 { 1.25 } else { 0.0 }
        };
        let trace = self.trace(picture, statistics, keep);
        let (value, by_outputs) = loss(&trace.outputs)?;
        check_length(
            "the derivatives of a loss",
            trace.outputs.len(),
            by_outputs.len(),
        )?;
        let [first, second] = [0, 1].map(|i| &self.dense[i]);
        let mut by_hidden = second.backwards(&trace.hidden, &by_outputs, &mut gradient.dense[1]);
        for (slope, value) in by_hidden.iter_mut().zip(&trace.hidden) {
            if *value <= 0.0 {
                *slope = 0.0;
            }
        }
        let by_pooled = first.backwards(&trace.pooled, &by_hidden, &mut gradient.dense[0]);
        let last = &trace.convolved[trace.convolved.len() - 1];
        let (places, channels) = last.shape();
        let mut slopes = DMatrix::zeros(places, channels);
        for (channel, mut column) in slopes.column_iter_mut().enumerate() {
            column.fill(by_pooled[channel] * trace.kept[channel] / places as f32);
            let of_largest = channels + channel;
            column[trace.largest[channel]] += by_pooled[of_largest] * trace.kept[of_largest];
        }
        let mut side = Self::SIDE >> self.convolutions.len();
        for (number, layer) in self.convolutions.iter().enumerate().rev() {
            for (slope, value) in slopes.iter_mut().zip(&trace.convolved[number]) {
                if *value <= 0.0 {
                    *slope = 0.0;
                }
            }
            let sums = &mut gradient.convolutions[number];
            let seen = trace.neighbourhoods[number].transpose();
            sums.weights.gemm(1.0, &seen, &slopes, 1.0);
            for (sum, column) in sums.offsets.iter_mut().zip(slopes.column_iter()) {
                *sum += column.sum();
            }
            side *= 2;
            if number > 0 {
                let all = &slopes * layer.weights.transpose();
                slopes = gathered(&all, side, layer.weights.nrows() / 9);
            }
        }
        Ok(value)
    }

    fn trace(&self, picture: &[f32], statistics: &[f32], mut keep: impl FnMut() -> f32) -> Trace {
        let mut seen = Vec::with_capacity(self.convolutions.len());
        let mut convolved: Vec<DMatrix<f32>> = Vec::with_capacity(self.convolutions.len());
        let (mut side, mut channels) = (Self::SIDE, Self::CHANNELS);
        for layer in &self.convolutions {
            let before = convolved.last().map_or(picture, |values| values.as_slice());
            let all = neighbourhoods(before, side, channels);
            let mut values = &all * &layer.weights;
            for (mut column, offset) in values.column_iter_mut().zip(&layer.offsets) {
                column.apply(|value| *value = (*value + offset).max(0.0));
            }
            side /= 2;
            channels = layer.offsets.len();
            seen.push(all);
            convolved.push(values);
        }
        let last = &convolved[convolved.len() - 1];
        let mut pooled: Vec<f32> = last
            .column_iter()
            .map(|c| c.sum() / c.len() as f32)
            .collect();
        let largest: Vec<usize> = last.column_iter().map(|column| column.imax()).collect();
        pooled.extend(largest.iter().enumerate().map(|(c, &at)| last[(at, c)]));
        pooled.extend(statistics);
        let kept: Vec<f32> = pooled.iter().map(|_| keep()).collect();
        for (value, kept) in pooled.iter_mut().zip(&kept) {
            *value *= kept;
        }
        let mut hidden = self.dense[0].outputs(&pooled);
        for value in &mut hidden {
            *value = value.max(0.0);
        }
        let outputs = self.dense[1].outputs(&hidden);
        Trace {
            neighbourhoods: seen,
            convolved,
            pooled,
            kept,
            largest,
            hidden,
            outputs,
        }
    }

    /// All numbers, layer by layer, as little-endian `f32`.
    pub fn to_bytes(&self) -> Vec<u8> {
        let numbers = self.parameters().flatten();
        numbers.flat_map(|number| number.to_le_bytes()).collect()
    }

    /// The network that [`to_bytes`](Self::to_bytes) wrote, of so many statistics and outputs.
    ///
    /// # Errors
    /// [`Error::Length`] for another number of bytes, [`Error::NotFinite`] for a number that is not
    /// finite.
    pub fn from_bytes(statistics: usize, outputs: usize, bytes: &[u8]) -> Result<Self> {
        let mut network = Self::random(statistics, outputs, 0);
        let count: usize = network.parameters().map(<[f32]>::len).sum();
        check_length("the bytes of a network", 4 * count, bytes.len())?;
        let (numbers, _) = bytes.as_chunks::<4>();
        let mut numbers = numbers
            .iter()
            .map(|four| f32::from_le_bytes(*four))
            .enumerate();
        for value in network.parameters_mut().flatten() {
            if let Some((index, number)) = numbers.next() {
                if !number.is_finite() {
                    return Err(Error::NotFinite {
                        what: "the network",
                        index,
                        value: number.into(),
                    });
                }
                *value = number;
            }
        }
        Ok(network)
    }
}

/// Adam (Kingma and Ba 2015, arXiv:1412.6980) with the decay of weights apart from the gradient
/// (Loshchilov and Hutter 2019, arXiv:1711.05101).
///
/// ```
/// use lobes::inference::{Adam, Network};
/// let mut network = Network::random(0, 1, 1);
/// let mut adam = Adam::new(&network);
/// let gradient = network.zeros();
/// adam.step(&mut network, &gradient, 1e-3, 0.0);
/// assert_eq!(network, Network::random(0, 1, 1)); // No slope, no step.
/// ```
#[derive(Debug, Clone)]
pub struct Adam {
    mean: Network,
    square: Network,
    steps: i32,
}

impl Adam {
    /// How slowly the means of gradients and of their squares forget.
    const MEMORY: [f32; 2] = [0.9, 0.999];

    /// A descent that begins at `network`.
    pub fn new(network: &Network) -> Self {
        Self {
            mean: network.zeros(),
            square: network.zeros(),
            steps: 0,
        }
    }

    /// Moves the network against a gradient by about `rate` a number, and every number towards 0 by
    /// `rate` · `decay` of itself. The gradient is that of a network of the same shape.
    pub fn step(&mut self, network: &mut Network, gradient: &Network, rate: f32, decay: f32) {
        let [short, long] = Self::MEMORY;
        self.steps = self.steps.saturating_add(1);
        let (first, second) = (1.0 - short.powi(self.steps), 1.0 - long.powi(self.steps));
        let numbers = network.parameters_mut().flatten();
        let slopes = gradient.parameters().flatten();
        let means = self.mean.parameters_mut().flatten();
        let squares = self.square.parameters_mut().flatten();
        for (((number, slope), mean), square) in numbers.zip(slopes).zip(means).zip(squares) {
            *mean = short * *mean + (1.0 - short) * slope;
            *square = long * *square + (1.0 - long) * slope * slope;
            let step = *mean / first / ((*square / second).sqrt() + 1e-8);
            *number -= rate * (step + decay * *number);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(seed: u64, count: usize) -> Vec<f32> {
        let mut rng = Pcg64::seed_from_u64(seed);
        (0..count).map(|_| rng.random::<f32>() - 0.5).collect()
    }

    /// A convolution by its definition, every sum written out in f64, and what rounding each of so
    /// many sums and products to f32 may change of it: γ_n Σ |terms| (Higham 2002,
    /// doi:10.1137/1.9780898718027, section 3.1).
    fn plain(layer: &Layer, picture: &[f32], side: usize, channels: usize) -> Vec<(f64, f64)> {
        let rounding = (9 * channels + 2) as f64 * 0.5 * f64::from(f32::EPSILON);
        let half = side / 2;
        let mut values = Vec::new();
        for (c, offset) in layer.offsets.iter().enumerate() {
            for place in 0..half * half {
                let mut sum = f64::from(*offset);
                let mut size = sum.abs();
                for from in 0..channels {
                    for i in 0..3 {
                        for j in 0..3 {
                            let (row, column) = (2 * (place / half) + i, 2 * (place % half) + j);
                            if row < side && column < side {
                                let pixel = picture[(from * side + row) * side + column];
                                let weight = layer.weights[(9 * from + 3 * i + j, c)];
                                let term = f64::from(pixel) * f64::from(weight);
                                sum += term;
                                size += term.abs();
                            }
                        }
                    }
                }
                values.push((sum.max(0.0), 1.01 * rounding * size));
            }
        }
        values
    }

    #[test]
    fn a_convolution_is_the_sum_that_defines_it() {
        let network = Network::random(5, 3, 7);
        let input = picture(1, Network::INPUTS);
        let trace = network.trace(&input, &[0.1; 5], || 1.0);
        let first = plain(&network.convolutions[0], &input, 64, 4);
        let close = |found: &DMatrix<f32>, expected: &[(f64, f64)]| {
            assert_eq!(found.len(), expected.len());
            for (found, (expected, rounding)) in found.iter().zip(expected) {
                assert!((f64::from(*found) - expected).abs() <= *rounding);
                assert!(*rounding < 1e-3);
            }
        };
        close(&trace.convolved[0], &first);
        let second = plain(
            &network.convolutions[1],
            trace.convolved[0].as_slice(),
            32,
            CHANNELS[0],
        );
        close(&trace.convolved[1], &second);
    }

    #[test]
    fn gathering_is_the_adjoint_of_neighbourhoods() {
        let (x, side) = (picture(2, 2 * 16 * 16), 16);
        let all = neighbourhoods(&x, side, 2);
        let y = DMatrix::from_vec(64, 18, picture(3, 64 * 18));
        let there: f64 = all.iter().zip(&y).map(|(a, b)| f64::from(a * b)).sum();
        let back = gathered(&y, side, 2);
        let here: f64 = back.iter().zip(&x).map(|(a, b)| f64::from(a * b)).sum();
        assert!((there - here).abs() < 1e-4, "{there} {here}");
    }

    /// The gradient against differences of the loss, in numbers of every layer.
    #[test]
    fn the_gradient_is_that_of_the_loss() {
        let network = Network::random(5, 3, 11);
        let input = picture(4, Network::INPUTS);
        let statistics = [0.3, -0.2, 0.9, 0.0, 1.0];
        let loss = |outputs: &[f32]| {
            let sum = outputs.iter().map(|v| 50.0 * v * v).sum::<f32>();
            Ok((sum, outputs.iter().map(|v| 100.0 * v).collect()))
        };
        // The same draws each time.
        let rng = || Pcg64::seed_from_u64(5);
        let mut gradient = network.zeros();
        network
            .learn(&input, &statistics, &mut gradient, &mut rng(), loss)
            .unwrap();
        let mut first = 0;
        for (layer, slopes) in gradient.parameters().enumerate() {
            // The four numbers of each layer that the loss depends on most.
            let mut order: Vec<usize> = (0..slopes.len()).collect();
            order.sort_by(|&a, &b| slopes[b].abs().total_cmp(&slopes[a].abs()));
            for &index in &order[..slopes.len().min(4)] {
                let at = |step: f32| {
                    let mut moved = network.clone();
                    *moved.parameters_mut().flatten().nth(first + index).unwrap() += step;
                    let mut unused = moved.zeros();
                    let value = moved.learn(&input, &statistics, &mut unused, &mut rng(), loss);
                    f64::from(value.unwrap())
                };
                let step = 1e-3;
                let found = (at(step) - at(-step)) / f64::from(2.0 * step);
                let expected = f64::from(slopes[index]);
                assert!(expected.abs() > 0.05, "{layer}: {expected}");
                // A rectifier may switch within the step.
                assert!(
                    (found - expected).abs() < 0.03 * expected.abs() + 0.01,
                    "{layer} {index}: {found} {expected}"
                );
            }
            first += slopes.len();
        }
    }

    #[test]
    fn what_was_written_is_read() {
        let network = Network::random(2, 4, 3);
        let bytes = network.to_bytes();
        assert_eq!(Network::from_bytes(2, 4, &bytes).unwrap(), network);
        assert!(Network::from_bytes(2, 4, &bytes[1..]).is_err());
        let mut broken = bytes;
        broken[..4].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(Network::from_bytes(2, 4, &broken).is_err());
        assert!(network.outputs(&[0.0; 3], &[0.0; 2]).is_err());
        assert!(
            network
                .outputs(&vec![0.0; Network::INPUTS], &[0.0])
                .is_err()
        );
        let mut other = Network::random(2, 5, 3).zeros();
        let mut rng = Pcg64::seed_from_u64(1);
        let input = vec![0.0; Network::INPUTS];
        let loss = |outputs: &[f32]| Ok((0.0, outputs.to_vec()));
        let refused = network.learn(&input, &[0.0; 2], &mut other, &mut rng, loss);
        assert!(matches!(refused, Err(Error::Length { .. })));
    }
}
