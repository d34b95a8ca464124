//! Execution allocates nothing: plans are made once, and what they need to run the caller passes.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use lobes::Parallelism::Sequential;
use lobes::glam::{DQuat, DVec3};
use lobes::harmonics::{Basis, Coefficients, Rotation, Transform};
use lobes::sphere::Grid;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

/// The system's allocator, which counts what each thread asks for.
struct Counting;

// SAFETY: passes everything on; counting neither allocates nor unwinds.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's promises are the system allocator's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// How often `f` allocates.
fn allocations(f: impl FnOnce()) -> usize {
    let before = ALLOCATIONS.get();
    f();
    ALLOCATIONS.get() - before
}

#[test]
fn the_count_counts() {
    assert_eq!(allocations(|| drop(std::hint::black_box(vec![1.0; 9]))), 1);
}

#[test]
fn transforms() {
    for grid in [
        Grid::gauss_legendre(64, 128),
        Grid::lat_long(33, 65),
        Grid::clenshaw_curtis(34, 66),
    ] {
        let grid = grid.unwrap();
        let transform = Transform::new(&grid, grid.max_degree()).unwrap();
        for batch in [1, 3, 8, 37] {
            let mut sets = vec![0.5; batch * transform.coefficient_count()];
            let mut maps = vec![0.0; batch * grid.len()];
            let mut scratch = vec![0.0; transform.scratch_len(batch)];
            let count = allocations(|| {
                transform
                    .synthesise_into(batch, &sets, &mut maps, &mut scratch, Sequential)
                    .unwrap();
                transform
                    .analyse_into(batch, &maps, &mut sets, &mut scratch, Sequential)
                    .unwrap();
            });
            assert_eq!(count, 0, "{batch} maps, {:?}", grid.latitudes());
        }
    }
}

#[test]
fn values_sums_and_gradients() {
    for degree in [4, 60] {
        let basis = Basis::new(degree).unwrap();
        let f = Coefficients::zeros(degree);
        let directions = [DVec3::new(0.48, 0.64, 0.6); 11];
        let count = directions.len() * basis.count();
        let (mut values, mut gradients) = (vec![0.0; count], vec![0.0; 3 * count]);
        let (mut sums, mut slopes) = ([0.0; 11], [(0.0, DVec3::ZERO); 11]);
        let count = allocations(|| {
            basis.values(&directions, &mut values, Sequential).unwrap();
            basis
                .values_and_gradients(&directions, &mut values, &mut gradients, Sequential)
                .unwrap();
            basis.sums(&f, &directions, &mut sums, Sequential).unwrap();
            basis
                .gradients(&f, &directions, &mut slopes, Sequential)
                .unwrap();
        });
        assert_eq!(count, 0, "degree {degree}");
    }
}

#[test]
fn rotation() {
    let plan = Rotation::new(20).unwrap();
    let f = Coefficients::zeros_with_orders(20, 7);
    let mut out = Coefficients::zeros(20);
    let mut scratch = vec![0.0; plan.scratch_len()];
    let turn = DQuat::from_rotation_x(0.3);
    let count = allocations(|| {
        plan.rotate_into(&f, turn, &mut out, &mut scratch, Sequential)
            .unwrap();
    });
    assert_eq!(count, 0);
}

/// A plan at lmax 2047 is within 100 MB, tables and grid.
#[test]
fn memory_of_a_plan() {
    let grid = Grid::gauss_legendre(2048, 4096).unwrap();
    let transform = Transform::new(&grid, 2047).unwrap();
    let megabytes = transform.table_bytes() as f64 / 1e6;
    println!("tables at degree 2047: {megabytes:.1} MB");
    assert!((50.0..100.0).contains(&megabytes), "{megabytes} MB");
}
