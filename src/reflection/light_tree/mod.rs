//! The light as a tree: integrals against any lobe, with a bound of their errors. What holds, and
//! why: docs/reference/rendering-bound.md.

mod answer;
mod cut;
mod descent;
mod ggx_lobe;
mod half_vector;
mod lobe;
mod neighbourhood;
mod opening;
mod parts;
mod rules;
#[cfg(test)]
mod sampled_bound;
mod small_angles;
mod tree;
mod ward_lobe;

pub use answer::{Bounded, BoundedImage};
pub use lobe::FunctionLobe;
pub use tree::LightTree;
