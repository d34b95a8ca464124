//! Division of a transform's work among threads, and of its scratch among them.

use std::sync::{Mutex, PoisonError};

use super::recurrence::{LANES, Lanes};
use crate::Parallelism;

/// Pieces of scratch that threads borrow and give back.
pub(crate) struct Slots<'a> {
    free: Mutex<Vec<&'a mut [Lanes]>>,
    length: usize,
}

impl<'a> Slots<'a> {
    /// Cuts scratch into slots of `length`.
    pub(crate) fn new(scratch: &'a mut [Lanes], length: usize) -> Self {
        Self {
            free: Mutex::new(scratch.chunks_exact_mut(length).collect()),
            length,
        }
    }

    /// Runs `f` on a slot that nobody else uses meanwhile.
    pub(crate) fn with<T>(&self, f: impl FnOnce(&mut [Lanes]) -> T) -> T {
        let free = || self.free.lock().unwrap_or_else(PoisonError::into_inner);
        let slot = free().pop();
        match slot {
            Some(slot) => {
                let value = f(slot);
                free().push(slot);
                value
            }
            // More threads than the plan counted when it was made.
            None => f(&mut vec![[0.0; LANES]; self.length]),
        }
    }
}

/// Runs `f(index, chunk)` on each chunk.
pub(crate) fn over_chunks<T: Send>(
    parallelism: Parallelism,
    slice: &mut [T],
    length: usize,
    f: impl Fn(usize, &mut [T]) + Sync + Send,
) {
    match parallelism {
        #[cfg(feature = "parallel")]
        Parallelism::Rayon => {
            use rayon::prelude::*;
            slice
                .par_chunks_mut(length)
                .enumerate()
                .for_each(|(i, chunk)| f(i, chunk));
        }
        _ => {
            for (i, chunk) in slice.chunks_mut(length).enumerate() {
                f(i, chunk);
            }
        }
    }
}

/// Runs `f(octet, north rows, south rows)` on each eight rows of a map and their mirror images. The south rows go from north to
/// south; the equator of an odd number of rings is a north row.
pub(crate) fn over_octets(
    parallelism: Parallelism,
    map: &mut [f64],
    columns: usize,
    f: impl Fn(usize, &mut [f64], &mut [f64]) + Sync + Send,
) {
    let rings = map.len() / columns;
    let (north, south) = map.split_at_mut(rings.div_ceil(2) * columns);
    let length = LANES * columns;
    match parallelism {
        #[cfg(feature = "parallel")]
        Parallelism::Rayon => {
            use rayon::prelude::*;
            // The last southern chunk is missing where the equator alone is the last octet.
            let south_count = south.len().div_ceil(length);
            let (with, without) = north.split_at_mut(north.len().min(south_count * length));
            with.par_chunks_mut(length)
                .zip(south.par_rchunks_mut(length))
                .enumerate()
                .for_each(|(i, (north, south))| f(i, north, south));
            if !without.is_empty() {
                f(south_count, without, &mut []);
            }
        }
        _ => {
            let mut south = south.rchunks_mut(length);
            for (i, north) in north.chunks_mut(length).enumerate() {
                f(i, north, south.next().unwrap_or_default());
            }
        }
    }
}

/// Runs `f(m, columns)` for the orders `first..last`; `columns` are those of order m, one slice a map, and `sets` hold the coefficients
/// of those orders only. `length(m)` is how many there are at order m.
pub(crate) fn over_orders<const MAPS: usize>(
    parallelism: Parallelism,
    (first, last): (usize, usize),
    mut sets: [&mut [f64]; MAPS],
    length: &(impl Fn(usize) -> usize + Sync),
    f: &(impl Fn(usize, [&mut [f64]; MAPS]) + Sync),
) {
    match parallelism {
        #[cfg(feature = "parallel")]
        Parallelism::Rayon if last - first > 1 => {
            let middle = (first + last) / 2;
            let at = (first..middle).map(length).sum();
            let mut halves = sets.map(|set| Some(set.split_at_mut(at)));
            let low = halves.each_mut().map(|half| {
                half.as_mut()
                    .map(|(low, _)| std::mem::take(low))
                    .unwrap_or_default()
            });
            let high = halves.map(|half| half.map(|(_, high)| high).unwrap_or_default());
            rayon::join(
                || over_orders(parallelism, (first, middle), low, length, f),
                || over_orders(parallelism, (middle, last), high, length, f),
            );
        }
        _ => {
            for m in first..last {
                let columns = sets
                    .each_mut()
                    .map(|set| set.split_off_mut(..length(m)).unwrap_or_default());
                f(m, columns);
            }
        }
    }
}
