//! Reading points, one module a format. A file is opened into a [`Source`]: its header at once, its
//! points later, in parts that threads may decode side by side. A cloud is never held in memory.

use std::path::Path;

use crate::{Error, Result};

/// Points handed on together, in the file's own frame and unit, all finite.
#[derive(Debug, Default)]
pub struct Batch {
    /// x, y, z of each point.
    pub points: Vec<[f64; 3]>,
    /// Index into [`Header::scans`] or the file's own scan number (LAS point source id) of each point.
    /// Empty when all points belong to `scan`.
    pub scans: Vec<u32>,
    /// The scan of all points when `scans` is empty.
    pub scan: u32,
}

/// One scan (setup) as far as the header tells.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// The number that [`Batch`] uses for it.
    pub number: u32,
    /// A key that depends on what the scan is (its GUID, or its name and place), never on the order of files.
    pub key: String,
    /// Where the scanner stood, in the frame of the points.
    pub position: Option<[f64; 3]>,
    /// Points promised, invalid ones included.
    pub points: Option<u64>,
}

/// What a file says of itself before its points are read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Header {
    /// Format and version as people write it: "LAS 1.4, point format 6, LAZ".
    pub format: String,
    /// Points promised, where the format says.
    pub points: Option<u64>,
    /// Smallest and largest x, y, z, where the format says.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Scans, where the format has them. LAS names its scans only point by point: then this is empty.
    pub scans: Vec<Scan>,
    /// Coordinate reference system, as WKT or "EPSG:n".
    pub crs: Option<String>,
    /// Points already found unusable (not finite) are not known before reading; see [`Source::read`].
    pub notes: Vec<String>,
}

/// An opened file.
pub trait Source: Send + Sync {
    /// What the file says of itself.
    fn header(&self) -> &Header;

    /// How many parts can be decoded independently of each other; at least 1.
    fn parts(&self) -> usize;

    /// Decode one part and hand its points on, at most some 64 Ki a batch. The batch is reused.
    /// Invalid returns (E57 invalid states, PTX 0 0 0) and coordinates that are not finite are left out
    /// and counted in the result.
    fn read(&self, part: usize, sink: &mut dyn FnMut(&Batch) -> Result<()>) -> Result<Skipped>;
}

/// Points of a part that were not handed on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Skipped {
    /// Directions without a return.
    pub invalid: u64,
    /// Coordinates that are NaN, infinite, or beyond 1e9 in size.
    pub not_finite: u64,
}

/// Open a file by what it holds; its suffix only decides between text formats.
///
/// # Errors
/// [`Error::BadFile`] when the content is not what the suffix says, is empty or cut short; [`Error::Io`] when it
/// cannot be opened; [`Error::Unsupported`] for a suffix that no reader knows, with the list of those that are known.
pub fn open(path: &Path) -> Result<Box<dyn Source>> {
    Err(Error::unsupported(path, "no reader yet"))
}
