//! Whites that are none.

use lobes::illumination::ChromaticAdaptation;

#[test]
fn a_white_that_no_cone_sees_is_refused() {
    for bad in [
        [0.0; 3],
        [f64::NAN, 1.0, 1.0],
        [f64::INFINITY, 1.0, 1.0],
        [-1.0, -1.0, -1.0],
        [0.0, 0.0, 1e300],
    ] {
        let wrong = ChromaticAdaptation::new(bad, [1.0; 3]);
        let wrong_to = ChromaticAdaptation::new([1.0; 3], bad);
        if bad[2] == 1e300 {
            // A blue light is saturated, yet every cone sees it.
            assert!(wrong.is_ok());
            continue;
        }
        assert!(
            wrong
                .unwrap_err()
                .to_string()
                .contains("the white of the light")
        );
        assert!(
            wrong_to
                .unwrap_err()
                .to_string()
                .contains("the white adapted to")
        );
    }
}

#[test]
fn adapting_keeps_the_brightness_of_the_white() {
    let light = [3.0, 2.0, 0.5];
    let adapted = ChromaticAdaptation::new(light, [1.0; 3])
        .unwrap()
        .apply(light);
    let luminance = lobes::illumination::Luminance::Rec709.of(light);
    for value in adapted {
        // BT.709's printed row has four digits.
        assert!(
            (value / luminance - 1.0).abs() < 1e-4,
            "{value} {luminance}"
        );
    }
}
