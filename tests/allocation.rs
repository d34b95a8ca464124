//! Execution allocates nothing: plans are made once, and what they need to run the caller passes.

mod counting_allocator;

use counting_allocator::{Counting, allocations, most_bytes};
use lobes::Parallelism::Sequential;
use lobes::glam::{DQuat, DVec3};
use lobes::harmonics::{Basis, Coefficients, Rotation, Transform};
use lobes::sphere::Grid;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// N bytes of a picture take no more than 2¹⁵ N and 1 MiB, whatever they hold: what packs best,
/// what claims too much, what is damaged.
#[test]
fn memory_of_a_picture() {
    use lobes::files::{Picture, Precision, decode, encode_exr};
    let mut files = Vec::new();
    let mut corpora = vec!["tests/data/pictures".to_owned()];
    for name in ["exr", "hdr", "pfm", "photograph"] {
        corpora.push(format!("fuzz/corpus/{name}"));
    }
    for folder in corpora {
        // A package holds no corpora.
        for entry in std::fs::read_dir(folder).into_iter().flatten() {
            files.push(std::fs::read(entry.unwrap().path()).unwrap());
        }
    }
    for (width, height) in [(512, 256), (2048, 1024)] {
        let pixels = vec![[0.0; 3]; width * height];
        let black = Picture {
            width,
            height,
            pixels,
        };
        for precision in [Precision::Half, Precision::Single] {
            files.push(encode_exr(&black, precision).unwrap());
        }
    }
    // One pixel and runs of it: four bytes stand for up to 2²⁴ pixels.
    for width in [40_000, 120_000, 130_000, 60_000_000] {
        let mut bytes = format!("#?RADIANCE\n\n-Y 1 +X {width}\n").into_bytes();
        bytes.extend([9, 9, 9, 128]);
        for shift in (0..4).take_while(|shift| (width - 1) >> (8 * shift) > 0) {
            bytes.extend([1, 1, 1, ((width - 1) >> (8 * shift) & 255) as u8]);
        }
        bytes.resize(bytes.len() + 40, 0);
        files.push(bytes);
    }
    for size in ["8192 8192", "100 100", "1000000 1"] {
        files.push(format!("PF\n{size}\n-1.0\n").into_bytes());
    }
    let (mut read, mut refused) = (0, 0);
    for bytes in &files {
        let mut decoded = None;
        let most = most_bytes(|| decoded = decode(bytes).ok());
        *(if decoded.is_some() {
            &mut read
        } else {
            &mut refused
        }) += 1;
        let allowed = (bytes.len() << 15) + (1 << 20);
        assert!(
            most <= allowed,
            "{most} of {allowed}, {} bytes",
            bytes.len()
        );
    }
    assert!(read > 20 && refused > 5, "{read} read, {refused} refused");
}

/// The same of photographs, within 2¹⁶ N, and of tables, within 2⁶ N.
#[test]
fn memory_of_other_files() {
    use lobes::picture::Picture;
    let within = |bytes: &[u8], shift: u32, read: &dyn Fn()| {
        let (most, allowed) = (most_bytes(read), (bytes.len() << shift) + (1 << 20));
        assert!(most <= allowed, "{most} of {allowed}");
    };
    for side in [64, 1024, 2048] {
        let png = lobes::picture::encode_png(side, side, 1.0, |_, _| Some([0.0; 3])).unwrap();
        within(&png, 16, &|| {
            let picture = Picture::from_bytes(&png).unwrap();
            let _ = picture.circle().and_then(|circle| picture.sphere(circle));
        });
    }
    let table = "1,1,1,1,1\n".repeat(20_000);
    within(table.as_bytes(), 6, &|| {
        assert!(lobes::reflectance::fit::parse_csv(&table).is_ok());
    });
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
