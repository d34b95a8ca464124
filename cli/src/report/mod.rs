//! Figures, pages and the accuracy file.

mod accuracy;
mod difference;
mod figures;
mod page;
mod plot;

pub use accuracy::{
    AccuracyFile, AccuracyRow, BestRow, CeilingRow, Comparison, ContinuousRow, FilesRow,
    NamedConfusion,
};
pub use difference::difference;
pub use figures::{
    answers_calibration, calibration, confusion_matrix, feature_plane, light_spectra, posterior_map,
};
pub use page::{Figure, Image, Inline, Page};
pub use plot::{Axis, Chart, Mark, Naming, Series};
