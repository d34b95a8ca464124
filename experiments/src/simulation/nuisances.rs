//! What makes photographs hard to read.

/// What makes photographs hard to read, each of which can be left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Nuisances {
    /// Colours of bodies and of metals; without them all are grey.
    pub colour: bool,
    /// Albedos that vary: grain, marble, rust, prints, seams, holes.
    pub texture: bool,
    /// Normals that vary: bumps, dimples, brushed lines.
    pub relief: bool,
    /// Studios, lamps, flashes, the ground and its shadow, a person behind the camera.
    pub staging: bool,
    /// Walls and what else is seen behind the ball; without it that is black.
    pub backdrop: bool,
    /// Tone curves, colour, sharpening, blur, noise and JPEG.
    pub camera: bool,
    /// A circle whose centre is off by 1 % of its radius each way, and its radius by 1.5 %
    /// (standard deviations).
    pub outline: bool,
    /// Places that are not there: measured light that is altered, and dead leaves. Models learn from
    /// them; none is judged in them.
    pub invented: bool,
}

impl Nuisances {
    /// Everything at once, in light that was measured.
    pub const ALL: Self = Self {
        colour: true,
        texture: true,
        relief: true,
        staging: true,
        backdrop: true,
        camera: true,
        outline: true,
        invented: false,
    };

    /// Plain grey balls in measured light, before black, in sRGB.
    pub const NONE: Self = Self {
        colour: false,
        texture: false,
        relief: false,
        staging: false,
        backdrop: false,
        camera: false,
        outline: false,
        invented: false,
    };

    /// What tables list: nothing, each nuisance alone, and all together, with their names.
    pub fn listed() -> Vec<(&'static str, Self)> {
        let none = Self::NONE;
        vec![
            ("none: plain grey balls in measured light", none),
            (
                "colour",
                Self {
                    colour: true,
                    ..none
                },
            ),
            (
                "texture",
                Self {
                    texture: true,
                    ..none
                },
            ),
            (
                "relief",
                Self {
                    relief: true,
                    ..none
                },
            ),
            (
                "staging",
                Self {
                    staging: true,
                    ..none
                },
            ),
            (
                "backdrop",
                Self {
                    backdrop: true,
                    ..none
                },
            ),
            (
                "camera",
                Self {
                    camera: true,
                    ..none
                },
            ),
            (
                "outline",
                Self {
                    outline: true,
                    ..none
                },
            ),
            ("all: wild", Self::ALL),
        ]
    }
}
