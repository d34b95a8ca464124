//! Arithmetic and elementary functions under everything else: nothing here knows of spheres or
//! light.
//!
//! | file | what | accuracy |
//! | --- | --- | --- |
//! | `double_double` | numbers of 106 bits, one | a few 2⁻¹⁰⁶ an operation |
//! | `wide_double` | the same, eight at a time | the same |
//! | `exponential` | e^(−x), eight at a time | 2 ulp |
//! | `sincospi` | sine and cosine of a part of a turn | 6·10⁻¹⁶ absolute |
//! | `quadrature` | Gauss–Legendre, Fejér, Clenshaw–Curtis | the last bit of nodes and weights |
//! | `sixteen_points` | the Gauss–Legendre rule of sixteen nodes on (0, 1) | the same |
//! | `bilinear` | interpolation among four values | a few rounding errors |
//! | `factorial` | square roots of factorials, with exponents | a few 2⁻¹⁰⁶ times k |
//! | `golden_section` | the minimum of a function of one variable | its root of the rounding |

pub(crate) mod bilinear;
pub(crate) mod double_double;
pub(crate) mod exponential;
pub(crate) mod factorial;
pub(crate) mod golden_section;
pub(crate) mod quadrature;
pub(crate) mod sincospi;
pub(crate) mod sixteen_points;
pub(crate) mod wide_double;
