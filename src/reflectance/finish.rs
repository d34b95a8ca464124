//! The finish of a surface: what of a material does not depend on its colour.

use super::material::Material;
use crate::named;
use crate::serialisation::by_name;

/// The finish of a surface: how it shines, whatever its colour.
///
/// The colour of a body and the colour of the light cannot be told apart where no highlight shows
/// the light, so tables count the finish beside the name.
///
/// ```
/// use lobes::reflectance::{Finish, presets};
/// let finishes: Vec<Finish> = presets().iter().map(|material| material.finish()).collect();
/// assert_eq!(finishes[0], Finish::Matte); // brown matte
/// assert_eq!(finishes[2], Finish::GlossyPlastic); // black plastic
/// assert_eq!(finishes[5], Finish::RoughMetal); // old gold
/// assert_eq!(finishes[7], Finish::SmoothMetal); // silver
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Finish {
    /// Nothing is specular.
    Matte,
    /// A body under a clear surface: `ρ_s` is below [`Finish::METAL`], as Fresnel's equations have
    /// it for anything that does not conduct (4 % at an index of 1.5, 18 % for diamond).
    GlossyPlastic,
    /// A metal whose σ is at least [`Finish::ROUGH`].
    RoughMetal,
    /// A metal whose σ is below [`Finish::ROUGH`], mirrors among them.
    SmoothMetal,
}

impl Finish {
    /// Every finish, in the order in which tables list them.
    pub const ALL: [Self; 4] = [
        Self::Matte,
        Self::GlossyPlastic,
        Self::RoughMetal,
        Self::SmoothMetal,
    ];

    /// The mean `ρ_s` of the channels from which a material counts as a metal.
    ///
    /// At normal incidence diamond, of index 2.42, reflects 0.17, and of the metals titanium, one
    /// of the darkest, more than 0.4.
    pub const METAL: f64 = 0.2;

    /// The σ from which a metal counts as rough: below it a picture of 128 pixels shows no blur,
    /// since the pixels themselves are as wide.
    pub const ROUGH: f64 = 0.02;

    /// Its place in [`ALL`](Self::ALL).
    ///
    /// ```
    /// use lobes::reflectance::Finish;
    /// assert_eq!(Finish::ALL[Finish::RoughMetal.index()], Finish::RoughMetal);
    /// ```
    pub const fn index(self) -> usize {
        self as usize
    }

    /// The name that `FromStr` reads.
    ///
    /// ```
    /// use lobes::reflectance::Finish;
    /// for finish in Finish::ALL {
    ///     assert_eq!(finish.name().parse::<Finish>().unwrap(), finish);
    /// }
    /// ```
    pub fn name(self) -> &'static str {
        match self {
            Self::Matte => "matte",
            Self::GlossyPlastic => "glossy plastic",
            Self::RoughMetal => "rough metal",
            Self::SmoothMetal => "smooth metal",
        }
    }
}

named!(Finish, "finish");
by_name!(Finish);

impl Material {
    /// How it shines, whatever its colour.
    pub fn finish(&self) -> Finish {
        let specular = self.specular().iter().sum::<f64>() / 3.0;
        if self.is_matte() {
            Finish::Matte
        } else if specular < Finish::METAL {
            Finish::GlossyPlastic
        } else if self.roughness().sigma() < Finish::ROUGH {
            Finish::SmoothMetal
        } else {
            Finish::RoughMetal
        }
    }

    /// Whether pictures of the two differ in their colour and brightness alone and no highlight
    /// shows the colour of the light: both are matte, or both are metals of one roughness.
    ///
    /// The body of a metal, which is weak, is taken to be of the metal's colour.
    ///
    /// ```
    /// use lobes::reflectance::presets;
    /// let [brown, white, _, blue, sky, _, gold, silver] = &presets()[..] else { unreachable!() };
    /// assert!(brown.differs_in_colour_alone(white) && gold.differs_in_colour_alone(silver));
    /// assert!(!blue.differs_in_colour_alone(sky) && !white.differs_in_colour_alone(silver));
    /// ```
    pub fn differs_in_colour_alone(&self, other: &Self) -> bool {
        let metal = matches!(self.finish(), Finish::RoughMetal | Finish::SmoothMetal);
        self.finish() == other.finish()
            && (self.is_matte() || (metal && self.roughness() == other.roughness()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limits_are_where_they_are_said_to_be() {
        let finish = |specular: f64, sigma: f64| {
            Material::from_albedos("m", [0.1; 3], [specular; 3], sigma)
                .unwrap()
                .finish()
        };
        assert_eq!(finish(0.0, 0.0), Finish::Matte);
        assert_eq!(finish(1e-9, 0.3), Finish::GlossyPlastic);
        assert_eq!(finish(0.17, 0.0), Finish::GlossyPlastic);
        assert_eq!(finish(0.4, 0.019), Finish::SmoothMetal);
        assert_eq!(finish(0.4, 0.02), Finish::RoughMetal);
    }
}
