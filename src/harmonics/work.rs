//! Division of a transform's work among threads, and of its scratch with it.

use std::ops::Range;

use super::lane::Lane;
use crate::Parallelism;
use crate::cancellation::cancellable;

/// What some of the items of a piece of work write to.
pub(crate) trait Divide: Send + Sized {
    /// The part of the first `items` items, and the rest.
    fn divide(self, items: usize) -> (Self, Self);
}

/// Runs `f(items, piece, scratch)` on parts of `items`, each with its own `share` of the scratch:
/// as many parts as there are shares, or one on the caller's thread. Allocates nothing.
pub(crate) fn divided<P: Divide, T: Send>(
    parallelism: Parallelism,
    items: Range<usize>,
    piece: P,
    scratch: &mut [T],
    share: usize,
    f: &(impl Fn(Range<usize>, P, &mut [T]) + Sync),
) {
    if parallelism.threads() > 1 && items.len() > 1 && scratch.len() >= 2 * share {
        let middle = items.start + items.len() / 2;
        let (low, high) = piece.divide(middle - items.start);
        let (mine, other) = scratch.split_at_mut(scratch.len() / share / 2 * share);
        let (first, second) = (items.start..middle, middle..items.end);
        join(
            || divided(parallelism, first, low, mine, share, f),
            || divided(parallelism, second, high, other, share, f),
        );
    } else {
        f(items, piece, &mut scratch[..share]);
    }
}

/// Runs `f` inside the thread pool, so that what it divides need not enter it again and again.
pub(crate) fn inside_pool(parallelism: Parallelism, f: impl FnOnce() + Send) {
    if parallelism.threads() > 1 {
        join(f, || ());
    } else {
        f();
    }
}

#[cfg(feature = "parallel")]
pub(crate) fn join(a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
    rayon::join(a, b);
}

#[cfg(not(feature = "parallel"))]
pub(crate) fn join(a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
    a();
    b();
}

/// Items of one length each, one after the other.
pub(crate) struct Chunks<'a, T> {
    pub(crate) values: &'a mut [T],
    pub(crate) length: usize,
}

impl<T: Send> Divide for Chunks<'_, T> {
    fn divide(self, items: usize) -> (Self, Self) {
        let length = self.length;
        let (low, high) = self
            .values
            .split_at_mut((items * length).min(self.values.len()));
        let part = |values| Self { values, length };
        (part(low), part(high))
    }
}

/// Northern rows by lane, and their mirror images; empty where a lane has none.
pub(crate) type Rows<R, T> = [<R as Lane>::Each<T>; 2];

/// As many rows of a map as there are lanes, and their mirror images, each. The southern rows go from north to south; the
/// equator of an odd number of rings is a northern row.
pub(crate) struct Bundles<'a, R> {
    north: &'a mut [R],
    south: &'a mut [R],
    /// Where each ring of the whole map begins, and where the last one ends.
    starts: &'a [usize],
    /// The ring of the first row that is left.
    first: usize,
}

impl<'a, R: Lane> Bundles<'a, R> {
    pub(crate) fn new(map: &'a mut [R], starts: &'a [usize]) -> Self {
        let (north, south) = map.split_at_mut(starts[(starts.len() - 1).div_ceil(2)]);
        Self {
            north,
            south,
            starts,
            first: 0,
        }
    }

    /// How long the rows of these northern rings are together, and those of their mirror images.
    fn lengths(&self, first: usize, end: usize) -> (usize, usize) {
        let rings = self.starts.len() - 1;
        let north = |ring: usize| self.starts[ring.min(rings.div_ceil(2))];
        let south = |ring: usize| self.starts[rings - ring.min(rings / 2)];
        (north(end) - north(first), south(first) - south(end))
    }
}

impl<'a, R: Lane> Iterator for Bundles<'a, R> {
    type Item = Rows<R, &'a mut [R]>;

    /// The rows of the next bundle.
    fn next(&mut self) -> Option<Self::Item> {
        if self.north.is_empty() {
            return None;
        }
        let first = self.first;
        self.first += R::LANES;
        let mut row = |lane: usize, southern: bool| {
            let (north, south) = self.lengths(first + lane, first + lane + 1);
            let row = if southern {
                self.south.split_off_mut(self.south.len() - south..)
            } else {
                self.north.split_off_mut(..north)
            };
            row.unwrap_or_default()
        };
        Some([
            R::each(|lane| row(lane, false)),
            R::each(|lane| row(lane, true)),
        ])
    }
}

impl<R: Lane> Divide for Bundles<'_, R> {
    fn divide(self, items: usize) -> (Self, Self) {
        let middle = self.first + items * R::LANES;
        let (north, south) = self.lengths(self.first, middle);
        let (first, starts) = (self.first, self.starts);
        let (north, rest) = self.north.split_at_mut(north);
        let (remote, south) = self.south.split_at_mut(self.south.len() - south);
        let part = |north, south, first| Self {
            north,
            south,
            starts,
            first,
        };
        (part(north, south, first), part(rest, remote, middle))
    }
}

/// The columns of consecutive orders, of several coefficient sets.
pub(crate) struct Orders<'a, T, const MAPS: usize> {
    pub(crate) sets: [&'a mut [T]; MAPS],
    /// The order of the first columns.
    pub(crate) first: usize,
    pub(crate) degree: usize,
}

impl<T, const MAPS: usize> Orders<'_, T, MAPS> {
    /// How long the columns of order m are together.
    fn length(degree: usize, m: usize) -> usize {
        (degree + 1 - m) * if m == 0 { 1 } else { 2 }
    }
}

impl<'a, T, const MAPS: usize> Iterator for Orders<'a, T, MAPS> {
    type Item = [&'a mut [T]; MAPS];

    /// The columns of the next order.
    fn next(&mut self) -> Option<Self::Item> {
        let length = Self::length(self.degree, self.first);
        self.first += 1;
        Some(
            self.sets
                .each_mut()
                .map(|set| set.split_off_mut(..length).unwrap_or_default()),
        )
    }
}

impl<T: Send, const MAPS: usize> Divide for Orders<'_, T, MAPS> {
    fn divide(mut self, items: usize) -> (Self, Self) {
        let (first, degree) = (self.first, self.degree);
        let length = (first..first + items)
            .map(|m| Self::length(degree, m))
            .sum::<usize>();
        let sets = self
            .sets
            .each_mut()
            .map(|set| set.split_off_mut(..length).unwrap_or_default());
        let rest = Self {
            first: first + items,
            ..self
        };
        (
            Self {
                sets,
                first,
                degree,
            },
            rest,
        )
    }
}

/// Runs `f(index, chunk)` on each chunk.
pub(crate) fn over_chunks<T: Send>(
    parallelism: Parallelism,
    slice: &mut [T],
    length: usize,
    f: impl Fn(usize, &mut [T]) + Sync + Send,
) {
    let f = cancellable(|(i, chunk): (usize, &mut [T])| f(i, chunk));
    match parallelism {
        #[cfg(feature = "parallel")]
        Parallelism::Rayon => {
            use rayon::prelude::*;
            slice.par_chunks_mut(length).enumerate().for_each(f);
        }
        _ => {
            slice.chunks_mut(length).enumerate().for_each(f);
        }
    }
}

/// Runs `f(index, chunk, chunk)` on each two chunks, each of its own length.
pub(crate) fn over_chunk_pairs<T: Send>(
    parallelism: Parallelism,
    (first, first_length): (&mut [T], usize),
    (second, second_length): (&mut [T], usize),
    f: impl Fn(usize, &mut [T], &mut [T]) + Sync + Send,
) {
    let f = cancellable(|(i, (first, second)): (usize, (&mut [T], &mut [T]))| f(i, first, second));
    match parallelism {
        #[cfg(feature = "parallel")]
        Parallelism::Rayon => {
            use rayon::prelude::*;
            first
                .par_chunks_mut(first_length)
                .zip(second.par_chunks_mut(second_length))
                .enumerate()
                .for_each(f);
        }
        _ => {
            let pairs = first
                .chunks_mut(first_length)
                .zip(second.chunks_mut(second_length));
            pairs.enumerate().for_each(f);
        }
    }
}
