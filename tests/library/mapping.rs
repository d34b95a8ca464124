//! Pictures of the sphere: known directions, round trips, solid angles, and light read through
//! them.

use std::f64::consts::PI;

use lobes::glam::DVec3;
use lobes::sphere::Mapping;
use proptest::prelude::*;

fn sphere() -> impl Strategy<Value = DVec3> {
    (-1.0..=1.0, -PI..PI).prop_map(|(y, azimuth): (f64, f64)| {
        let s = (1.0 - y * y).sqrt();
        DVec3::new(s * azimuth.sin(), y, -s * azimuth.cos())
    })
}

proptest! {
    #[test]
    fn a_direction_comes_back(direction in sphere()) {
        for mapping in Mapping::ALL {
            let (u, v) = mapping.position(direction);
            let back = mapping.direction(u, v).expect("inside the picture");
            // u = ½ + ½ sin α is rounded to ε/2, and the direction turns by 4 du/cos α: a mirror
            // ball loses its rim.
            let allowed = match mapping {
                Mapping::MirrorBall => 1e-15 + 1e-15 / (0.5 * (1.0 + direction.z)).sqrt().max(1e-8),
                _ => 4e-15,
            };
            prop_assert!((back - direction).length() < allowed, "{mapping}: {direction} {back}");
            prop_assert!((back.length() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn a_point_comes_back(u in 0.0..1.0f64, v in 0.0..1.0f64) {
        for mapping in Mapping::ALL {
            if let Some(direction) = mapping.direction(u, v) {
                let (u2, v2) = mapping.position(direction);
                // Near the rim of a disc and the poles the direction forgets where on the line it
                // was.
                let flat = mapping.solid_angle_density(u, v) / (4.0 * PI);
                prop_assert!((u2 - u).hypot(v2 - v) < 1e-14 / flat.min(1.0), "{mapping}: {u} {v} {u2} {v2}");
            }
        }
    }

    /// The density is the Jacobian: the area of the small triangle that the picture's small
    /// triangle shows.
    #[test]
    fn the_density_is_the_jacobian(u in 0.001..0.999f64, v in 0.001..0.999f64) {
        let step = 1e-5;
        for mapping in Mapping::ALL {
            let at = |u, v| mapping.direction(u, v);
            if let (Some(left), Some(right), Some(above), Some(below)) =
                (at(u - step, v), at(u + step, v), at(u, v - step), at(u, v + step))
            {
                // A central difference across the edge of two faces is not a derivative.
                if (left - right).length() > 1e-3 || (above - below).length() > 1e-3 {
                    continue;
                }
                let area = (right - left).cross(above - below).length() / (4.0 * step * step);
                let density = mapping.solid_angle_density(u, v);
                let crosses_an_edge = matches!(mapping, Mapping::VerticalCross | Mapping::HorizontalCross)
                    && [3.0, 4.0].iter().any(|n| {
                        [u, v].iter().any(|p| ((p * n).fract() - 0.5).abs() > 0.5 - 1e-4)
                    });
                if !crosses_an_edge {
                    // The mirror ball's map bends sharply at its rim, where n → 0.
                    let n2 = 1.0 - (2.0 * u - 1.0).powi(2) - (1.0 - 2.0 * v).powi(2);
                    let allowed = if mapping == Mapping::MirrorBall { 1e-6 / n2.powi(2) } else { 1e-5 };
                    prop_assert!((area - density).abs() < allowed * 16.0, "{mapping} {u} {v}: {area} {density}");
                }
            }
        }
    }
}

/// The picture drawn by hand: what each named point of each mapping shows.
#[test]
fn known_points_show_known_directions() {
    use Mapping::*;
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let diagonal = |a: DVec3, b: DVec3| (a + b).normalize();
    let disc = |radius: f64, degrees: f64| {
        let angle = degrees.to_radians();
        (
            0.5 + 0.5 * radius * angle.cos(),
            0.5 - 0.5 * radius * angle.sin(),
        )
    };
    let cases = [
        (LatLong, (0.5, 0.5), -z),
        (LatLong, (0.75, 0.5), x),
        (LatLong, (0.25, 0.5), -x),
        (LatLong, (1.0, 0.5), z),
        (LatLong, (0.3, 0.0), y),
        (LatLong, (0.3, 1.0), -y),
        (LatLong, (0.5, 0.25), diagonal(-z, y)),
        (AngularMap, disc(0.0, 0.0), -z),
        (AngularMap, disc(0.5, 0.0), x),
        (AngularMap, disc(0.5, 90.0), y),
        (AngularMap, disc(0.5, 180.0), -x),
        (AngularMap, disc(0.25, 90.0), diagonal(-z, y)),
        (AngularMap, disc(0.75, 0.0), diagonal(z, x)),
        (AngularMap, disc(1.0, 0.0), z),
        (MirrorBall, disc(0.0, 0.0), z),
        (MirrorBall, disc(0.5f64.sqrt(), 0.0), x),
        (MirrorBall, disc(0.5f64.sqrt(), 90.0), y),
        (MirrorBall, disc((PI / 8.0).sin(), 90.0), diagonal(z, y)),
        (MirrorBall, disc(1.0, 0.0), -z),
        (VerticalCross, (0.5, 1.0 / 8.0), y),
        (VerticalCross, (1.0 / 6.0, 3.0 / 8.0), -x),
        (VerticalCross, (0.5, 3.0 / 8.0), -z),
        (VerticalCross, (5.0 / 6.0, 3.0 / 8.0), x),
        (VerticalCross, (0.5, 5.0 / 8.0), -y),
        (VerticalCross, (0.5, 7.0 / 8.0), z),
        // The edges fold together: up from ahead is the lower edge of the zenith's face …
        (VerticalCross, (0.5, 0.25), diagonal(-z, y)),
        (VerticalCross, (1.0 / 3.0, 3.0 / 8.0), diagonal(-z, -x)),
        (VerticalCross, (0.5, 0.75), diagonal(z, -y)),
        // … and the far ends meet behind and above.
        (VerticalCross, (0.5, 0.0), diagonal(z, y)),
        (VerticalCross, (0.5, 1.0), diagonal(z, y)),
        (VerticalCross, (0.0, 3.0 / 8.0), diagonal(z, -x)),
        (HorizontalCross, (3.0 / 8.0, 1.0 / 6.0), y),
        (HorizontalCross, (1.0 / 8.0, 0.5), -x),
        (HorizontalCross, (3.0 / 8.0, 0.5), -z),
        (HorizontalCross, (5.0 / 8.0, 0.5), x),
        (HorizontalCross, (7.0 / 8.0, 0.5), z),
        (HorizontalCross, (3.0 / 8.0, 5.0 / 6.0), -y),
        (HorizontalCross, (0.0, 0.5), diagonal(z, -x)),
        (HorizontalCross, (1.0, 0.5), diagonal(z, -x)),
        (HorizontalCross, (0.75, 0.5), diagonal(z, x)),
    ];
    for (mapping, (u, v), expected) in cases {
        let got = mapping.direction(u, v).unwrap();
        // A rim at r = 1 is met to √ε only.
        let allowed = if mapping == MirrorBall { 3e-8 } else { 1e-15 };
        assert!(
            (got - expected).length() < allowed,
            "{mapping} {u} {v}: {got}, not {expected}"
        );
    }
}

#[test]
fn what_is_outside_shows_nothing() {
    for (mapping, u, v) in [
        (Mapping::AngularMap, 0.1, 0.1),
        (Mapping::MirrorBall, 0.9, 0.9),
        (Mapping::VerticalCross, 0.1, 0.1),
        (Mapping::VerticalCross, 0.9, 0.9),
        (Mapping::HorizontalCross, 0.9, 0.1),
        (Mapping::LatLong, 0.5, 1.1),
        (Mapping::LatLong, f64::NAN, 0.5),
    ] {
        assert_eq!(mapping.direction(u, v), None, "{mapping}");
        assert_eq!(mapping.solid_angle_density(u, v), 0.0, "{mapping}");
    }
}

/// The midpoint rule over the square: second order on the smooth mappings, first order at the rims
/// of the discs.
#[test]
fn the_solid_angle_is_that_of_the_sphere() {
    let n = 1200; // divisible by 3 and 4: no midpoint on an edge
    for mapping in Mapping::ALL {
        let mut sum = 0.0;
        for row in 0..n {
            for column in 0..n {
                let (u, v) = (
                    (column as f64 + 0.5) / n as f64,
                    (row as f64 + 0.5) / n as f64,
                );
                sum += mapping.solid_angle_density(u, v);
            }
        }
        let error = sum / (n * n) as f64 / (4.0 * PI) - 1.0;
        let allowed = match mapping {
            Mapping::MirrorBall => 1e-4, // the density drops from 16 to 0 at the rim
            _ => 3e-6,
        };
        assert!(error.abs() < allowed, "{mapping}: {error:e}");
    }
}

#[test]
fn the_shape_tells_the_mapping_or_asks() {
    assert_eq!(Mapping::guess(512, 256).unwrap(), Mapping::LatLong);
    assert_eq!(Mapping::guess(768, 1024).unwrap(), Mapping::VerticalCross);
    assert_eq!(Mapping::guess(1024, 768).unwrap(), Mapping::HorizontalCross);
    for (size, words) in [
        ((900, 900), "--mapping angular-map"),
        ((640, 480 + 1), "fit no mapping"),
        ((0, 0), "fit no mapping"),
        ((usize::MAX, usize::MAX / 2), "fit no mapping"), // no overflow into a fit,
    ] {
        let error = Mapping::guess(size.0, size.1).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    for mapping in Mapping::ALL {
        assert_eq!(mapping.name().parse::<Mapping>().unwrap(), mapping);
    }
    let error = "fisheye".parse::<Mapping>().unwrap_err().to_string();
    assert_eq!(
        error,
        "there is no mapping \"fisheye\"; the names are lat-long, angular-map, mirror-ball, vertical-cross, horizontal-cross"
    );
}
