//! The part of asbuilt whose work grows with the points: decoding files, gathering voxel evidence,
//! and the kernels that grow with cells times angles. It knows no Python, prints nothing, reads no
//! configuration, and gives the same bytes for any number of threads.

pub mod boxes;
mod brick;
pub mod coarse;
pub mod error;
pub mod gather;
pub mod heights;
pub mod hits;
pub mod hough;
mod lattice;
pub mod layer;
pub mod patches;
pub mod places;
pub mod read;
pub mod sparse;
pub mod store;
pub mod trace;
pub mod voxel;

pub use error::{Error, Result};
