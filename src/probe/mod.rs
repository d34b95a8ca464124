//! Light from photographs of a mirror ball: brackets, the ball's outline, unwrapping for a camera
//! that is near, two sides, and a sun that every exposure clipped.
//!
//! ```text
//! photographs of one view ─ Bracket ─ one picture of radiance ─ refine ─ the ball's outline
//!                                                                  │
//!                  another side ─ merge ─ ProbeMap ─ unwrap ───────┘
//!                                             │
//!                    a grey ball ─ restore_sun ─ a map with its sun
//! ```
//!
//! The map is in the camera's frame: the camera stands towards +z, +y is up, and the centre column
//! looks along −z, past the ball.

mod bracket;
mod outline;
mod sun;
mod unwrap;

#[cfg(feature = "files")]
pub use bracket::exposure_of;
pub use bracket::{Bracket, Radiance};
pub use outline::refine;
pub use sun::restore_sun;
pub use unwrap::{MirrorBall, ProbeMap, merge};
