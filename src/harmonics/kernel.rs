//! The inner loops of the transform: sums over degree and sums over rings, a ring in each lane.

#![expect(
    clippy::needless_range_loop,
    reason = "several arrays of one const length are walked together"
)]

use fearless_simd::f64x8;
use fearless_simd::prelude::*;

use super::lane::Lane;
use super::recurrence::{Bundle, EQUATORIAL, Entry, LANES, Lanes, POLAR, Recurrence, Step};

/// North cosine, north sine, south cosine, south sine of a pair of rings in each lane.
pub(crate) type Quad<R = f64> = [<R as Lane>::Lanes; 4];

/// The state of the recurrence on `WIDTH` bundles, the first `POLES` of them in the polar form.
struct State<S: Simd, R: Lane, const WIDTH: usize, const POLES: usize> {
    argument: [R::Vector<S>; WIDTH],
    /// What rounding has taken from the argument, in single precision.
    rest: [R::Vector<S>; WIDTH],
    p: [R::Vector<S>; WIDTH],
    d: [R::Vector<S>; WIDTH],
}

impl<S: Simd, R: Lane, const WIDTH: usize, const POLES: usize> State<S, R, WIDTH, POLES> {
    #[inline(always)]
    fn new(simd: S, bundles: &[Bundle<R>; WIDTH]) -> Self {
        let zero = [R::splat(simd, R::default()); WIDTH];
        let mut argument = zero;
        let mut rest = zero;
        for v in 0..WIDTH {
            argument[v] = R::load(simd, &bundles[v].argument);
            rest[v] = R::load(simd, &bundles[v].rest);
        }
        Self {
            argument,
            rest,
            p: zero,
            d: zero,
        }
    }

    /// Takes the entries at step k and returns the step of the next, or the last step.
    #[inline(always)]
    fn admit(
        &mut self,
        simd: S,
        entries: &mut [&[Entry<R>]; WIDTH],
        k: usize,
        last: usize,
    ) -> usize {
        let mut next = last;
        for v in 0..WIDTH {
            while let Some(entry) = entries[v].first() {
                if entry.step > k {
                    next = next.min(entry.step);
                    break;
                }
                self.p[v] = R::load(simd, &entry.p);
                self.d[v] = R::load(simd, &entry.d);
                entries[v] = &entries[v][1..];
            }
        }
        next
    }

    /// One step of the bundles from `FROM`.
    #[inline(always)]
    fn advance<const FROM: usize>(&mut self, simd: S, step: &Step<R>) {
        let a = R::splat(simd, step[0]);
        for v in FROM..WIDTH {
            if v < POLES {
                let mut u = self.argument[v].mul_add(a, R::splat(simd, step[POLAR]));
                // Here u is small beside both of its terms, and the product comes after them.
                if const { R::SINGLE } {
                    u = self.rest[v].mul_add(a, u);
                }
                self.d[v] = u.mul_add(self.p[v], self.d[v]);
                self.p[v] += self.d[v];
            } else {
                // Here u is up to 4, and the constant less: its rounding weighs less.
                let mut u = R::splat(simd, step[EQUATORIAL]);
                if const { R::SINGLE } {
                    u = self.rest[v].mul_add(a, u);
                }
                u = self.argument[v].mul_add(a, u);
                self.d[v] = u.mul_sub(self.p[v], self.d[v]);
                self.p[v] = self.d[v] - self.p[v];
            }
        }
    }
}

/// The `WIDTH` bundles of a block.
#[inline(always)]
pub(super) fn block<T, const WIDTH: usize>(bundles: &[T], first: usize) -> &[T; WIDTH] {
    bundles[first..]
        .first_chunk()
        .expect("a block lies within the bundles")
}

/// The step at which the first of some bundles enters.
#[inline(always)]
fn first_step<R: Lane>(entries: &[&[Entry<R>]], last: usize) -> usize {
    entries
        .iter()
        .filter_map(|e| e.first())
        .map(|e| e.step)
        .fold(last, usize::min)
}

/// What [`synthesise_block`] sums: `[map][part][bundle]`.
pub(super) type Totals<S, R, const WIDTH: usize, const MAPS: usize> =
    [[[<R as Lane>::Vector<S>; WIDTH]; 4]; MAPS];

/// Adds p_k · sums of one step to the totals of the bundles from `FROM`.
#[inline(always)]
pub(super) fn add_step<
    S: Simd,
    R: Lane,
    const FROM: usize,
    const WIDTH: usize,
    const MAPS: usize,
>(
    simd: S,
    p: &[R::Vector<S>; WIDTH],
    totals: &mut Totals<S, R, WIDTH, MAPS>,
    sums: &[[R; 4]; MAPS],
) {
    for map in 0..MAPS {
        for part in 0..4 {
            let factor = R::splat(simd, sums[map][part]);
            for v in FROM..WIDTH {
                totals[map][part][v] = p[v].mul_add(factor, totals[map][part][v]);
            }
        }
    }
}

/// Some steps of the bundles from `FROM`.
#[inline(always)]
fn synthesise_steps<
    S: Simd,
    R: Lane,
    const FROM: usize,
    const WIDTH: usize,
    const MAPS: usize,
    const POLES: usize,
>(
    simd: S,
    state: &mut State<S, R, WIDTH, POLES>,
    totals: &mut Totals<S, R, WIDTH, MAPS>,
    steps: &[Step<R>],
    sums: &[[[R; 4]; MAPS]],
) {
    for (step, sums) in steps.iter().zip(sums) {
        add_step::<S, R, FROM, WIDTH, MAPS>(simd, &state.p, totals, sums);
        state.advance::<FROM>(simd, step);
    }
}

/// Σ_k p_k · sums for `MAPS` maps on `WIDTH` bundles; `sums[k]` from
/// [`Recurrence::prepare`](super::recurrence::Recurrence::prepare), `out[map][bundle]`. The bundles
/// nearer the pole enter later: until the first of the first half does, the others go alone.
#[inline(always)]
fn synthesise_block<
    S: Simd,
    R: Lane,
    const MAPS: usize,
    const WIDTH: usize,
    const HALF: usize,
    const POLES: usize,
>(
    simd: S,
    recurrence: &Recurrence<R>,
    m: usize,
    first: usize,
    sums: &[[[R; 4]; MAPS]],
    out: &mut [&mut [Quad<R>]; MAPS],
) {
    let bundles = block(&recurrence.bundles, first);
    let steps = recurrence.steps(m);
    let mut entries = std::array::from_fn(|v| recurrence.entries(m, first + v));
    let last = steps.len();
    let mut state = State::<S, R, WIDTH, POLES>::new(simd, bundles);
    let mut totals = [[[R::splat(simd, R::default()); WIDTH]; 4]; MAPS];
    let mut k = first_step(&entries, last);
    let whole = first_step(&entries[..HALF.max(1)], last);
    while k < last {
        let next = state.admit(simd, &mut entries, k, last);
        let (steps, sums) = (&steps[k..next], &sums[k..next]);
        if HALF > 0 && k < whole {
            synthesise_steps::<S, R, HALF, WIDTH, MAPS, POLES>(
                simd,
                &mut state,
                &mut totals,
                steps,
                sums,
            );
        } else {
            synthesise_steps::<S, R, 0, WIDTH, MAPS, POLES>(
                simd,
                &mut state,
                &mut totals,
                steps,
                sums,
            );
        }
        k = next;
    }
    store_totals(simd, bundles, first, &totals, out);
}

/// The sums of the northern and the southern rings of a block from their even and odd parts.
#[inline(always)]
pub(super) fn store_totals<S: Simd, R: Lane, const MAPS: usize, const WIDTH: usize>(
    simd: S,
    bundles: &[Bundle<R>; WIDTH],
    first: usize,
    totals: &Totals<S, R, WIDTH, MAPS>,
    out: &mut [&mut [Quad<R>]; MAPS],
) {
    for map in 0..MAPS {
        for v in 0..WIDTH {
            let x = R::load(simd, &bundles[v].x);
            let [ec, es, oc, os] = [
                totals[map][0][v],
                totals[map][1][v],
                totals[map][2][v],
                totals[map][3][v],
            ];
            x.mul_add(oc, ec).store_array(&mut out[map][first + v][0]);
            x.mul_add(os, es).store_array(&mut out[map][first + v][1]);
            (ec - x * oc).store_array(&mut out[map][first + v][2]);
            (es - x * os).store_array(&mut out[map][first + v][3]);
        }
    }
}

/// Two steps at a time of the bundles from `FROM`; the last step is even.
#[inline(always)]
fn analyse_steps<
    S: Simd,
    R: Lane,
    const FROM: usize,
    const WIDTH: usize,
    const MAPS: usize,
    const POLES: usize,
>(
    simd: S,
    state: &mut State<S, R, WIDTH, POLES>,
    parts: &[&[Quad<R>; WIDTH]; MAPS],
    steps: &[Step<R>],
    sums: &mut [[R::Lanes; MAPS]],
) {
    for (steps, sums) in steps.as_chunks::<2>().0.iter().zip(sums) {
        let p = state.p;
        state.advance::<FROM>(simd, &steps[0]);
        let q = state.p;
        state.advance::<FROM>(simd, &steps[1]);
        add_two_steps::<S, R, FROM, WIDTH, MAPS>(simd, [&p, &q], parts, sums);
    }
}

/// Adds p_k · parts and p_{k+1} · parts, summed over the rings of the bundles from `FROM`.
#[inline(always)]
pub(super) fn add_two_steps<
    S: Simd,
    R: Lane,
    const FROM: usize,
    const WIDTH: usize,
    const MAPS: usize,
>(
    simd: S,
    [p, q]: [&[R::Vector<S>; WIDTH]; 2],
    parts: &[&[Quad<R>; WIDTH]; MAPS],
    sums: &mut [R::Lanes; MAPS],
) {
    for map in 0..MAPS {
        let [a, b, c, d] = weigh::<S, R, FROM, WIDTH>(simd, p, parts[map]);
        let [e, f, g, h] = weigh::<S, R, FROM, WIDTH>(simd, q, parts[map]);
        // Three rounds of interleaving and adding leave the eight totals in this order, in parts of
        // every eighth lane.
        let total = fold::<S, R>(
            fold::<S, R>(fold::<S, R>(a, e), fold::<S, R>(c, g)),
            fold::<S, R>(fold::<S, R>(b, f), fold::<S, R>(d, h)),
        );
        (R::load(simd, &sums[map]) + total).store_array(&mut sums[map]);
    }
}

/// Adds Σ over rings of p_k · parts to `sums[k / 2]`, four for each of two steps, for `MAPS` maps
/// on `WIDTH` bundles; `parts[map][bundle]` are even cosine, even sine, odd cosine · x, odd sine · x,
/// weighted.
#[inline(always)]
fn analyse_block<
    S: Simd,
    R: Lane,
    const MAPS: usize,
    const WIDTH: usize,
    const HALF: usize,
    const POLES: usize,
>(
    simd: S,
    recurrence: &Recurrence<R>,
    m: usize,
    first: usize,
    parts: &[&[Quad<R>]; MAPS],
    sums: &mut [[R::Lanes; MAPS]],
) {
    let bundles = block(&recurrence.bundles, first);
    let steps = recurrence.steps(m);
    let parts = parts.map(|parts| block(parts, first));
    let mut entries = std::array::from_fn(|v| recurrence.entries(m, first + v));
    let last = steps.len();
    let mut state = State::<S, R, WIDTH, POLES>::new(simd, bundles);
    let mut k = first_step(&entries, last);
    let whole = first_step(&entries[..HALF.max(1)], last);
    while k < last {
        let next = state.admit(simd, &mut entries, k, last);
        let (steps, sums) = (&steps[k..next], &mut sums[k / 2..next / 2]);
        if HALF > 0 && k < whole {
            analyse_steps::<S, R, HALF, WIDTH, MAPS, POLES>(simd, &mut state, &parts, steps, sums);
        } else {
            analyse_steps::<S, R, 0, WIDTH, MAPS, POLES>(simd, &mut state, &parts, steps, sums);
        }
        k = next;
    }
}

/// Interleaves two vectors and adds the halves: lanes 2i and 2i + 1 are sums of a and of b.
#[inline(always)]
fn fold<S: Simd, R: Lane>(a: R::Vector<S>, b: R::Vector<S>) -> R::Vector<S> {
    let (low, high) = a.interleave(b);
    low + high
}

/// p · parts summed over the bundles from `FROM`, each lane for itself.
#[inline(always)]
fn weigh<S: Simd, R: Lane, const FROM: usize, const WIDTH: usize>(
    simd: S,
    p: &[R::Vector<S>; WIDTH],
    parts: &[Quad<R>; WIDTH],
) -> [R::Vector<S>; 4] {
    // Loops and not closures: a closure would not be compiled for the wide vectors.
    let mut totals = [R::splat(simd, R::default()); 4];
    for part in 0..4 {
        let mut total = p[FROM] * R::load(simd, &parts[FROM][part]);
        for v in FROM + 1..WIDTH {
            let factor = R::load(simd, &parts[v][part]);
            total = p[v].mul_add(factor, total);
        }
        totals[part] = total;
    }
    totals
}

/// p_k on the bundles of a block, `table[k][bundle]`, and from which step on each bundle's are not all
/// zero.
#[inline(always)]
pub(super) fn tabulate<S: Simd, R: Lane, const WIDTH: usize, const POLES: usize>(
    simd: S,
    recurrence: &Recurrence<R>,
    m: usize,
    first: usize,
    table: &mut [[R::Lanes; WIDTH]],
) -> [usize; WIDTH] {
    let steps = recurrence.steps(m);
    let last = steps.len();
    let mut entries = std::array::from_fn(|v| recurrence.entries(m, first + v));
    let begins = entries.map(|entries| entries.first().map_or(last, |entry| entry.step));
    let mut state = State::<S, R, WIDTH, POLES>::new(simd, block(&recurrence.bundles, first));
    let mut k = first_step(&entries, last);
    while k < last {
        let next = state.admit(simd, &mut entries, k, last);
        for (step, table) in steps[k..next].iter().zip(&mut table[k..next]) {
            for v in 0..WIDTH {
                state.p[v].store_array(&mut table[v]);
            }
            state.advance::<0>(simd, step);
        }
        k = next;
    }
    begins
}

/// p and d of a bundle at order m, every `stride` steps.
#[inline(always)]
pub(super) fn states<S: Simd>(
    simd: S,
    recurrence: &Recurrence,
    m: usize,
    bundle: usize,
    stride: usize,
    states: &mut Vec<[Lanes; 2]>,
) {
    if recurrence.bundles[bundle].is_polar() {
        follow::<S, 1>(simd, recurrence, m, bundle, stride, states);
    } else {
        follow::<S, 0>(simd, recurrence, m, bundle, stride, states);
    }
}

/// As [`states`].
#[inline(always)]
fn follow<S: Simd, const POLES: usize>(
    simd: S,
    recurrence: &Recurrence,
    m: usize,
    bundle: usize,
    stride: usize,
    states: &mut Vec<[Lanes; 2]>,
) {
    let steps = recurrence.steps(m);
    let mut entries = [recurrence.entries(m, bundle)];
    let mut state = State::<S, f64, 1, POLES>::new(simd, block(&recurrence.bundles, bundle));
    // Entries are at multiples of the stride.
    for (chunk, steps) in steps.chunks(stride).enumerate() {
        state.admit(simd, &mut entries, chunk * stride, steps.len());
        states.push([state.p[0].into(), state.d[0].into()]);
        for step in steps {
            state.advance::<0>(simd, step);
        }
    }
}

/// How many rings, or steps, the product of eight maps takes at once: as many as the registers hold
/// sums of.
const TILE: usize = 4;

/// Σ_k p_k · sums of eight maps, a lane a map, on the rings of a block: `out[ring]`.
#[inline(always)]
fn synthesise_block_of_eight<
    S: Simd,
    const WIDTH: usize,
    const _HALF: usize,
    const POLES: usize,
>(
    simd: S,
    recurrence: &Recurrence,
    m: usize,
    first: usize,
    sums: &[Quad],
    (out, table): &mut (&mut [Quad], &mut [Lanes]),
) {
    let table = &mut table.as_chunks_mut().0[..recurrence.steps(m).len()];
    let begins = tabulate::<S, f64, WIDTH, POLES>(simd, recurrence, m, first, table);
    let bundles = block::<_, WIDTH>(&recurrence.bundles, first);
    let out = &mut out.as_chunks_mut::<LANES>().0[first..first + WIDTH];
    for v in 0..WIDTH {
        let (table, sums) = (&table[begins[v]..], &sums[begins[v]..]);
        for (tile, out) in out[v].as_chunks_mut::<TILE>().0.iter_mut().enumerate() {
            let mut totals = [[f64x8::splat(simd, 0.0); 4]; TILE];
            for (p, sums) in table.iter().zip(sums) {
                let p = &p[v].as_chunks::<TILE>().0[tile];
                let mut factors = [f64x8::splat(simd, 0.0); 4];
                for part in 0..4 {
                    factors[part] = f64x8::load_array_ref(simd, &sums[part]);
                }
                for ring in 0..TILE {
                    let p = f64x8::splat(simd, p[ring]);
                    for part in 0..4 {
                        totals[ring][part] = p.mul_add(factors[part], totals[ring][part]);
                    }
                }
            }
            let x = &bundles[v].x.as_chunks::<TILE>().0[tile];
            for ring in 0..TILE {
                let x = f64x8::splat(simd, x[ring]);
                let [ec, es, oc, os] = totals[ring];
                x.mul_add(oc, ec).store_array(&mut out[ring][0]);
                x.mul_add(os, es).store_array(&mut out[ring][1]);
                (ec - x * oc).store_array(&mut out[ring][2]);
                (es - x * os).store_array(&mut out[ring][3]);
            }
        }
    }
}

/// Adds Σ over the rings of a block of p_k · parts, `parts[ring]`, to `sums[k]` of eight maps, a
/// lane a map.
#[inline(always)]
fn analyse_block_of_eight<S: Simd, const WIDTH: usize, const _HALF: usize, const POLES: usize>(
    simd: S,
    recurrence: &Recurrence,
    m: usize,
    first: usize,
    parts: &[Quad],
    (sums, table): &mut (&mut [Quad], &mut [Lanes]),
) {
    let table = &mut table.as_chunks_mut().0[..recurrence.steps(m).len()];
    let begins = tabulate::<S, f64, WIDTH, POLES>(simd, recurrence, m, first, table);
    let parts = &parts.as_chunks::<LANES>().0[first..first + WIDTH];
    for v in 0..WIDTH {
        let (tables, last_table) = table[begins[v]..].as_chunks::<TILE>();
        let (sums, last_sums) = sums[begins[v]..].as_chunks_mut::<TILE>();
        for (p, sums) in tables.iter().zip(sums) {
            analyse_tile(simd, v, p, &parts[v], sums);
        }
        // The steps are even in number.
        let rest = last_table.as_chunks::<2>().0.iter();
        for (p, sums) in rest.zip(last_sums.as_chunks_mut().0) {
            analyse_tile(simd, v, p, &parts[v], sums);
        }
    }
}

/// Some steps of eight rings.
#[inline(always)]
fn analyse_tile<S: Simd, const STEPS: usize, const WIDTH: usize>(
    simd: S,
    v: usize,
    p: &[[Lanes; WIDTH]; STEPS],
    parts: &[Quad; LANES],
    sums: &mut [Quad; STEPS],
) {
    let mut totals = [[f64x8::splat(simd, 0.0); 4]; STEPS];
    for step in 0..STEPS {
        for part in 0..4 {
            totals[step][part] = f64x8::load_array_ref(simd, &sums[step][part]);
        }
    }
    for ring in 0..LANES {
        let mut factors = [f64x8::splat(simd, 0.0); 4];
        for part in 0..4 {
            factors[part] = f64x8::load_array_ref(simd, &parts[ring][part]);
        }
        for step in 0..STEPS {
            let p = f64x8::splat(simd, p[step][v][ring]);
            for part in 0..4 {
                totals[step][part] = p.mul_add(factors[part], totals[step][part]);
            }
        }
    }
    for step in 0..STEPS {
        for part in 0..4 {
            totals[step][part].store_array(&mut sums[step][part]);
        }
    }
}

/// Runs a kernel on every block of bundles. Where `$halved`, four bundles go as twice two; vectors of
/// fewer lanes than a bundle have room for one bundle only.
macro_rules! over_blocks {
    ($kernel:ident $(<$number:ident $(, $maps:ident)?>)?, $halved:expr, $simd:ident, $recurrence:ident, $m:ident, $a:ident, $b:expr) => {
        for block in &$recurrence.blocks {
            macro_rules! run {
                ($first:expr, $width:literal, $half:literal, $poles:literal) => {
                    $simd.vectorize(
                        #[inline(always)]
                        || {
                            $kernel::<S, $($number, $($maps,)?)? $width, $half, $poles>(
                                $simd,
                                $recurrence,
                                $m,
                                $first,
                                $a,
                                $b,
                            )
                        },
                    )
                };
            }
            let first = block.first;
            if const { S::f64s::LEN == LANES } {
                match (block.width, block.polar) {
                    (4, 0) if !$halved => run!(first, 4, 2, 0),
                    (4, 2) if !$halved => run!(first, 4, 2, 2),
                    (4, _) if !$halved => run!(first, 4, 2, 4),
                    (4, 0) => {
                        run!(first, 2, 1, 0);
                        run!(first + 2, 2, 1, 0)
                    }
                    (4, 2) => {
                        run!(first, 2, 1, 2);
                        run!(first + 2, 2, 1, 0)
                    }
                    (4, _) => {
                        run!(first, 2, 1, 2);
                        run!(first + 2, 2, 1, 2)
                    }
                    (2, 0) => run!(first, 2, 1, 0),
                    (2, 1) => run!(first, 2, 1, 1),
                    (2, _) => run!(first, 2, 1, 2),
                    (_, 0) => run!(first, 1, 0, 0),
                    (_, _) => run!(first, 1, 0, 1),
                }
            } else if block.polar == 0 {
                run!(first, 1, 0, 0)
            } else {
                run!(first, 1, 0, 1)
            }
        }
    };
}

/// Synthesis of `MAPS` maps (1 or 3) at order m: see [`synthesise_block`].
#[inline(always)]
pub(crate) fn synthesise<S: Simd, R: Lane, const MAPS: usize>(
    simd: S,
    recurrence: &Recurrence<R>,
    m: usize,
    sums: &[[[R; 4]; MAPS]],
    out: &mut [&mut [Quad<R>]; MAPS],
) {
    // The sums of three maps fill the registers with two bundles.
    over_blocks!(
        synthesise_block<R, MAPS>,
        MAPS > 1,
        simd,
        recurrence,
        m,
        sums,
        out
    );
}

/// Analysis of `MAPS` maps (1 or 3) at order m: see [`analyse_block`].
#[inline(always)]
pub(crate) fn analyse<S: Simd, R: Lane, const MAPS: usize>(
    simd: S,
    recurrence: &Recurrence<R>,
    m: usize,
    parts: &[&[Quad<R>]; MAPS],
    sums: &mut [[R::Lanes; MAPS]],
) {
    over_blocks!(analyse_block<R, MAPS>, false, simd, recurrence, m, parts, sums);
}

/// Synthesis of eight maps at order m, see [`synthesise_block_of_eight`]: their sums by ring, and a
/// table to work in.
#[inline(always)]
pub(crate) fn synthesise_eight<S: Simd>(
    simd: S,
    recurrence: &Recurrence,
    m: usize,
    sums: &[Quad],
    mut out: (&mut [Quad], &mut [Lanes]),
) {
    over_blocks!(
        synthesise_block_of_eight,
        false,
        simd,
        recurrence,
        m,
        sums,
        &mut out
    );
}

/// Analysis of eight maps at order m, see [`analyse_block_of_eight`]: their sums by step, and a
/// table to work in.
#[inline(always)]
pub(crate) fn analyse_eight<S: Simd>(
    simd: S,
    recurrence: &Recurrence,
    m: usize,
    parts: &[Quad],
    mut out: (&mut [Quad], &mut [Lanes]),
) {
    over_blocks!(
        analyse_block_of_eight,
        false,
        simd,
        recurrence,
        m,
        parts,
        &mut out
    );
}
