//! Rotated splats against the published polynomials of their bases, Wigner's matrices, and what a
//! caller may give.

use lobes::glam::{DQuat, DVec3};
use lobes::harmonics::{MAX_SPLAT_DEGREE, SplatBasis, SplatRotation, wigner};
use lobes::{Error, Parallelism};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const ONE: Parallelism = Parallelism::Sequential;

fn noise(count: usize, seed: u64) -> Vec<f64> {
    let mut generator = Pcg64::seed_from_u64(seed);
    (0..count)
        .map(|_| generator.random::<f64>() - 0.5)
        .collect()
}

fn turns(count: usize) -> Vec<DQuat> {
    let numbers = noise(4 * count, 7);
    let of = |q: &[f64]| DQuat::from_xyzw(q[0], q[1], q[2], q[3]).normalize();
    numbers.chunks(4).map(of).collect()
}

/// The harmonics of degree 3 as 3DGS's and glTF's documents print them, and e3nn's, whose scale by
/// degree no rotation changes.
fn printed(basis: SplatBasis, direction: DVec3) -> [f64; 16] {
    let DVec3 { x, y, z } = direction;
    let (xx, yy, zz) = (x * x, y * y, z * z);
    if basis == SplatBasis::E3nn {
        let root = f64::sqrt;
        let (s20, s24) = (root(15.0) * x * z, 0.5 * root(15.0) * (zz - xx));
        return [
            1.0,
            root(3.0) * x,
            root(3.0) * y,
            root(3.0) * z,
            s20,
            root(15.0) * x * y,
            root(5.0) * (yy - 0.5 * (xx + zz)),
            root(15.0) * y * z,
            s24,
            root(42.0) / 6.0 * (s20 * z + s24 * x),
            root(7.0) * s20 * y,
            root(168.0) / 8.0 * (4.0 * yy - xx - zz) * x,
            0.5 * root(7.0) * y * (2.0 * yy - 3.0 * (xx + zz)),
            root(168.0) / 8.0 * (4.0 * yy - xx - zz) * z,
            root(7.0) * s24 * y,
            root(42.0) / 6.0 * (s24 * z - s20 * x),
        ];
    }
    [
        0.2820947917738781,
        -0.4886025119029199 * y,
        0.4886025119029199 * z,
        -0.4886025119029199 * x,
        1.092548430592079 * x * y,
        -1.092548430592079 * y * z,
        0.31539156525252 * (2.0 * zz - xx - yy),
        -1.092548430592079 * x * z,
        0.5462742152960395 * (xx - yy),
        -0.5900435899266435 * y * (3.0 * xx - yy),
        2.890611442640554 * x * y * z,
        -0.4570457994644657 * y * (4.0 * zz - xx - yy),
        0.3731763325901154 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
        -0.4570457994644657 * x * (4.0 * zz - xx - yy),
        1.445305721320277 * z * (xx - yy),
        -0.5900435899266435 * x * (xx - 3.0 * yy),
    ]
}

#[test]
fn colours_go_with_the_directions_that_they_were_seen_in() {
    let dot = |set: &[f64], y: [f64; 16]| set.iter().zip(y).map(|(a, b)| a * b).sum::<f64>();
    for basis in [SplatBasis::Inria, SplatBasis::Gltf, SplatBasis::E3nn] {
        let before = noise(20 * 16, 1);
        let mut after = before.clone();
        let turns = turns(20);
        let plan = SplatRotation::new(3, basis).unwrap();
        plan.rotate(&mut after, &turns, ONE).unwrap();
        let direction = DVec3::new(0.48, -0.64, 0.6);
        for ((before, after), turn) in before.chunks(16).zip(after.chunks(16)).zip(turns) {
            let (was, is) = (
                dot(before, printed(basis, direction)),
                dot(after, printed(basis, turn * direction)),
            );
            assert!((was - is).abs() < 2e-14, "{basis}, {turn}: {was} and {is}");
        }
    }
}

/// What a rotation makes of a set, by Wigner's matrices.
fn expected(degree: usize, basis: SplatBasis, turn: DQuat, set: &[f64]) -> Vec<f64> {
    let place = |l: usize, m: isize| match basis {
        SplatBasis::Lobes => lobes::harmonics::Coefficients::zeros(degree)
            .index(l, m)
            .unwrap(),
        _ => (l * l + l).wrapping_add_signed(m),
    };
    let sign = |m: isize| match basis {
        SplatBasis::Inria | SplatBasis::Gltf if m % 2 != 0 => -1.0,
        _ => 1.0,
    };
    let turn = match basis {
        SplatBasis::E3nn => DQuat::from_xyzw(turn.z, turn.x, turn.y, turn.w),
        _ => turn,
    };
    let mut out = vec![0.0; set.len()];
    for l in 0..=degree {
        let d = wigner::real_rotation_matrix(l, turn).unwrap();
        let orders = || -(l as isize)..=l as isize;
        for (i, m) in orders().enumerate() {
            out[place(l, m)] = orders()
                .enumerate()
                .map(|(j, k)| sign(m) * sign(k) * d[(i, j)] * set[place(l, k)])
                .sum();
        }
    }
    out
}

#[test]
fn each_set_turns_as_wigners_matrices_say() {
    for degree in 1..=MAX_SPLAT_DEGREE {
        let count = (degree + 1).pow(2);
        for basis in SplatBasis::ALL {
            let plan = SplatRotation::new(degree, basis).unwrap();
            // Numbers of sets about those that go side by side, and of those that share a rotation.
            for (sets, share) in [(1, 1), (7, 1), (8, 8), (9, 3), (30, 30), (1030, 2)] {
                let before = noise(sets * count, 3);
                let turns = turns(sets / share);
                let mut after = before.clone();
                plan.rotate(&mut after, &turns, ONE).unwrap();
                let mut single: Vec<f32> = before.iter().map(|x| *x as f32).collect();
                plan.rotate(&mut single, &turns, ONE).unwrap();
                for set in (0..sets).step_by(sets.div_ceil(9)) {
                    let range = set * count..(set + 1) * count;
                    let turn = turns[set / share];
                    let want = expected(degree, basis, turn, &before[range.clone()]);
                    for (i, want) in range.zip(want) {
                        let place = format!("degree {degree}, {basis}, set {set} of {sets}");
                        assert!((after[i] - want).abs() < 1e-15, "{place}");
                        assert!((f64::from(single[i]) - want).abs() < 1e-7, "{place}, f32");
                    }
                }
            }
        }
    }
}

#[test]
fn channels_and_what_is_left_out_change_only_where_values_lie() {
    let (sets, degree) = (11, 3);
    let turns = turns(sets);
    let plan = SplatRotation::new(degree, SplatBasis::Inria).unwrap();
    let planar = noise(sets * 3 * 16, 5);
    let mut whole = planar.clone();
    plan.rotate(&mut whole, &turns, ONE).unwrap();
    // [set][channel][coefficient] as [set][coefficient][channel], without degree 0.
    let at = |set: usize, channel: usize, i: usize| (3 * set + channel) * 16 + i;
    let mut rest = Vec::new();
    for set in 0..sets {
        for i in 1..16 {
            rest.extend((0..3).map(|channel| planar[at(set, channel, i)]));
        }
    }
    let plan = plan.without_degree_0().with_channels(3).unwrap();
    assert_eq!((plan.set_len(), plan.degree()), (45, 3));
    plan.rotate(&mut rest, &turns, Parallelism::Rayon).unwrap();
    for (j, value) in rest.into_iter().enumerate() {
        let (set, i, channel) = (j / 45, j % 45 / 3 + 1, j % 3);
        assert_eq!(value, whole[at(set, channel, i)], "{set}, {i}, {channel}");
    }
}

#[test]
fn what_cannot_be_rotated_is_refused_and_left() {
    for degree in [0, MAX_SPLAT_DEGREE + 1] {
        let plan = SplatRotation::new(degree, SplatBasis::Inria);
        assert!(matches!(plan, Err(Error::Domain { .. })));
    }
    let plan = SplatRotation::new(1, SplatBasis::Gltf).unwrap();
    assert!(plan.clone().with_channels(0).is_err());
    let turn = DQuat::from_rotation_x(0.3);
    let mut none: [f32; 0] = [];
    plan.rotate(&mut none, &[turn], ONE).unwrap();
    plan.rotate(&mut none, &[], ONE).unwrap();
    let sets = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];
    let refused = |sets: &mut [f64], turns: &[DQuat]| {
        let before = sets.to_vec();
        let error = plan.rotate(sets, turns, ONE).unwrap_err();
        let same = before
            .iter()
            .zip(&*sets)
            .all(|(a, b)| a.total_cmp(b).is_eq());
        assert!(same, "changed");
        error
    };
    assert!(matches!(
        refused(&mut { sets }[..7], &[turn]),
        Error::Length { expected: 8, .. }
    ));
    for count in [0, 3, 4] {
        let error = refused(&mut { sets }, &vec![turn; count]);
        assert!(matches!(error, Error::Length { expected: 2, .. }));
    }
    for wrong in [
        turn * 1.001,
        turn * 0.0,
        turn * f64::NAN,
        turn * f64::INFINITY,
    ] {
        let error = refused(&mut { sets }, &[turn, wrong]);
        assert!(matches!(error, Error::NotUnit { index: 1, .. }), "{error}");
    }
    for wrong in [f64::NAN, f64::INFINITY] {
        let mut sets = sets;
        sets[6] = wrong;
        let error = refused(&mut sets, &[turn]);
        assert!(matches!(error, Error::NotFinite { index: 6, .. }));
    }
    let mut large = sets;
    large[6] = 1e308;
    assert!(matches!(
        refused(&mut large, &[turn]),
        Error::Overflow { .. }
    ));
    // A length that single precision brings is divided out.
    let mut off = sets;
    plan.rotate(&mut off, &[turn * 1.00005], ONE).unwrap();
    let mut right = sets;
    plan.rotate(&mut right, &[turn], ONE).unwrap();
    for (a, b) in off.iter().zip(right) {
        assert!((a - b).abs() < 1e-14);
    }
}
