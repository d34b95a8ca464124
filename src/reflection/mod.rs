//! The reflection equation: what a sphere looks like under an illumination.

#![expect(
    clippy::doc_markdown,
    reason = "the formulas are plain text, with subscripts"
)]

mod bright_pixels;
mod camera;
mod cells;
mod hat;
mod horizon_quadrature;
mod image;
mod irradiance;
mod kernel;
mod light_tree;
mod operator;
mod operator_lobe;
mod operator_table;
mod pyramid;
mod reference;
mod region;
mod renderer;
mod ring_renderer;
mod surface;

pub use camera::{Camera, ShadingPoint};
pub use image::{SphereImage, check_size};
pub use light_tree::{Bounded, BoundedImage, FunctionLobe, LightTree};
pub(crate) use operator::check_spectrum;
pub use operator::{Operator, Viewpoint};
pub use operator_table::{OperatorSet, OperatorTable};
pub use reference::{Reference, reference};
pub use renderer::{Renderer, Rendering, Settings};
pub use ring_renderer::{RingLight, RingRenderer};
pub use surface::Surface;
