//! Reading points, one module a format. A file is opened into a [`Source`]: its header at once, its
//! points later, in parts that threads may decode side by side. A cloud is never held in memory.

mod copc;
mod decimals;
mod e57;
mod input;
mod las;
mod laz;
mod lines;
mod pcd;
mod ply;
mod ptx;
mod records;
mod text;

use std::path::Path;

use crate::{Error, Result};
use input::Input;

/// Points that are handed on together: enough to forget the cost of the call, few enough to stay in the first cache.
const BATCH: usize = 512;

/// Records that are read together: enough to forget the cost of asking the system, few enough to stay in the second.
const READ: usize = 2 * 1024;

/// Points of one part, about: enough to forget the cost of starting it, few enough to keep every thread busy.
const PART: u64 = 256 * 1024;

/// Coordinates beyond this (in the file's unit) are no place on Earth: damaged data, or a marker for "nothing".
const FARTHEST: f64 = 1e9;

/// Points handed on together, in the file's own frame and unit, all finite.
#[derive(Debug, Default)]
pub struct Batch {
    /// x, y, z of each point.
    pub points: Vec<[f64; 3]>,
    /// The scan number of each point (see [`Header::scan_key`]). Empty when all points belong to `scan`.
    pub scans: Vec<u32>,
    /// The scan of all points when `scans` is empty.
    pub scan: u32,
}

/// One scan (setup) as far as the header tells.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// The number that [`Batch`] uses for it.
    pub number: u32,
    /// A key that depends on what the scan is (its GUID, or its place and points), never on the order of files.
    pub key: String,
    /// The name that its user gave it, where the format has one.
    pub name: Option<String>,
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
    /// Points promised, invalid ones included, where the format says; see [`Header::check`].
    pub points: Option<u64>,
    /// Smallest and largest x, y, z, where the format says. A claim: points may lie outside.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Scans, where the format has them. LAS names its scans only point by point: then this is empty.
    pub scans: Vec<Scan>,
    /// The first part of the keys of scans that only the points name; see [`Header::scan_key`].
    pub key: String,
    /// Coordinate reference system, as WKT or "EPSG:n".
    pub crs: Option<String>,
    /// What a user should know about how this file was understood, a line each.
    pub notes: Vec<String>,
}

impl Header {
    /// The key of the scan that a [`Batch`] calls `number`: the same key, whatever the order of files.
    pub fn scan_key(&self, number: u32) -> String {
        match self.scans.iter().find(|scan| scan.number == number) {
            Some(scan) => scan.key.clone(),
            None => format!("{}/{number}", self.key),
        }
    }

    /// Complain if fewer points were read than the header promises.
    ///
    /// `seen` counts the points of all parts: those handed on and those left out.
    ///
    /// # Errors
    /// [`Error::BadFile`] if points are missing.
    pub fn check(&self, path: &Path, seen: u64) -> Result<()> {
        match self.points {
            Some(promised) if seen < promised => Err(Error::bad_file(
                path,
                format!("the header promises {promised} points, the file holds {seen}; it is cut short"),
            )),
            _ => Ok(()),
        }
    }
}

/// An opened file.
pub trait Source: Send + Sync {
    /// What the file says of itself.
    fn header(&self) -> &Header;

    /// How many parts can be decoded independently of each other; at least 1.
    fn parts(&self) -> usize;

    /// Where the scans end, in bytes, if to find that out took reading the file; see [`open_known`].
    fn scan_ends(&self) -> Vec<u64> {
        Vec::new()
    }

    /// Decode one part and hand its points on, at most some 64 Ki a batch. The batch is reused.
    /// Invalid returns (E57 invalid states, PTX 0 0 0) and coordinates that are not finite are left out
    /// and counted in the result.
    ///
    /// # Errors
    /// [`Error::BadFile`] when the data is damaged or cut short, [`Error::Io`] when the system refuses,
    /// and whatever the sink returns.
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

/// Every format by name, with the suffixes of its files (lower case, no dot).
pub fn formats() -> &'static [(&'static str, &'static [&'static str])] {
    &[
        ("LAS", &["las", "laz"]),
        ("E57", &["e57"]),
        ("PLY", &["ply"]),
        ("PCD", &["pcd"]),
        ("PTX", &["ptx"]),
        ("PTS", &["pts"]),
        ("XYZ", &["xyz", "xyzn", "xyzrgb", "txt", "csv", "tsv", "asc"]),
    ]
}

/// Open a file by what it holds; its suffix only decides between text formats, but must not contradict the content.
///
/// # Errors
/// [`Error::BadFile`] when the content is not what the suffix says, is empty or cut short; [`Error::Io`] when it
/// cannot be opened; [`Error::Unsupported`] for a suffix that no reader knows, with the list of those that are known.
pub fn open(path: &Path) -> Result<Box<dyn Source>> {
    open_coarse(path, None)
}

/// The same; formats that keep points by levels of detail (COPC) give only those down to a `spacing` in the file's unit.
///
/// # Errors
/// As [`open`].
pub fn open_coarse(path: &Path, spacing: Option<f64>) -> Result<Box<dyn Source>> {
    open_known(path, spacing, &[])
}

/// The same, again: what [`Source::scan_ends`] told before is not looked for.
///
/// # Errors
/// As [`open`].
pub fn open_known(path: &Path, spacing: Option<f64>, scan_ends: &[u64]) -> Result<Box<dyn Source>> {
    let input = Input::open(path)?;
    let head = input.head(1024)?;
    if crate::store::is_evidence(&head) {
        return Err(input.bad("expected points, found an evidence file, which holds none"));
    }
    let suffix = path.extension().map(|s| s.to_string_lossy().to_lowercase()).unwrap_or_default();
    let expected = formats().iter().find(|(_, suffixes)| suffixes.contains(&suffix.as_str())).map(|(name, _)| *name);
    if suffix == "evidence" {
        return Err(input.bad(format!("expected evidence (first bytes asbuilt evidence), found {}", describe(&head))));
    }
    match (expected, sniff(&head)) {
        (None | Some("LAS"), Some("LAS")) => Ok(Box::new(las::Las::open(input, spacing)?)),
        (None | Some("E57"), Some("E57")) => Ok(Box::new(e57::E57::open(input)?)),
        (None | Some("PLY"), Some("PLY")) => Ok(Box::new(ply::Ply::open(input)?)),
        (None | Some("PCD"), Some("PCD")) => Ok(Box::new(pcd::Pcd::open(input)?)),
        (Some("PTX"), None) => Ok(Box::new(ptx::Ptx::open(input, scan_ends)?)),
        (Some(format @ ("PTS" | "XYZ")), None) => {
            // The suffix is the name by which people know it.
            let name = if format == "PTS" { "PTS".to_owned() } else { suffix.to_uppercase() };
            Ok(Box::new(text::Text::open(input, &name)?))
        }
        (Some(expected), _) => Err(input.bad(format!("expected {}, found {}", signature(expected), describe(&head)))),
        (None, _) => {
            let points = formats().iter().flat_map(|(_, suffixes)| suffixes.iter().copied());
            let known: Vec<_> = points.chain(["evidence"]).collect();
            Err(Error::unsupported(path, format!("unknown format; known suffixes are {}", known.join(", "))))
        }
    }
}

/// The format that the first bytes name.
fn sniff(head: &[u8]) -> Option<&'static str> {
    let is_pcd = || {
        let lines = head.split(|&byte| byte == b'\n').map(<[u8]>::trim_ascii);
        let mut lines = lines.skip_while(|line| line.starts_with(b"#") && !line.starts_with(b"# .PCD"));
        lines.next().is_some_and(|line| line.starts_with(b"# .PCD") || line.starts_with(b"VERSION "))
    };
    match head {
        _ if head.starts_with(b"LASF") => Some("LAS"),
        _ if head.starts_with(b"ASTM-E57") => Some("E57"),
        _ if head.starts_with(b"ply\n") || head.starts_with(b"ply\r") => Some("PLY"),
        _ if is_pcd() => Some("PCD"),
        _ => None,
    }
}

/// A format and how to tell it, for messages.
fn signature(format: &str) -> String {
    match format {
        "LAS" => "LAS (first bytes LASF)".into(),
        "E57" => "E57 (first bytes ASTM-E57)".into(),
        "PLY" => "PLY (first bytes ply)".into(),
        "PCD" => "PCD (first line # .PCD)".into(),
        other => format!("{other} text"),
    }
}

/// What a file seems to be, for messages.
fn describe(head: &[u8]) -> &'static str {
    match sniff(head) {
        Some(format) => format,
        None if head.iter().all(|&byte| byte >= 32 || matches!(byte, b'\t' | b'\n' | b'\r')) => "text",
        None => "unknown binary data",
    }
}

/// Gathers points into batches for a sink, leaving out those that are nowhere.
struct Collector<'a> {
    batch: Batch,
    skipped: Skipped,
    sink: &'a mut dyn FnMut(&Batch) -> Result<()>,
}

impl<'a> Collector<'a> {
    fn new(scan: u32, sink: &'a mut dyn FnMut(&Batch) -> Result<()>) -> Self {
        let batch = Batch { points: Vec::with_capacity(BATCH), scans: Vec::new(), scan };
        Self { batch, skipped: Skipped::default(), sink }
    }

    /// One more point of the batch's scan.
    #[inline]
    fn push(&mut self, point: [f64; 3]) -> Result<()> {
        self.batch.points.push(point);
        if self.batch.points.len() == BATCH { self.flush() } else { Ok(()) }
    }

    /// Hand on a block of points, at most [`BATCH`], of the batch's scan, or each of its own in `scans`.
    #[inline]
    fn extend(&mut self, points: impl Iterator<Item = [f64; 3]>, scans: impl Iterator<Item = u32>) -> Result<()> {
        self.flush()?;
        self.batch.points.extend(points);
        self.batch.scans.extend(scans);
        self.flush()
    }

    /// Hand on what has been gathered, without the points that are nowhere.
    fn flush(&mut self) -> Result<()> {
        let Batch { points, scans, .. } = &mut self.batch;
        // Nearly always all are somewhere, and this way the check costs next to nothing.
        if !points.as_flattened().iter().fold(true, |all, value| all & is_somewhere(value)) {
            let before = points.len();
            let mut places = points.iter();
            scans.retain(|_| places.next().is_some_and(|point| point.iter().all(is_somewhere)));
            points.retain(|point| point.iter().all(is_somewhere));
            self.skipped.not_finite += (before - points.len()) as u64;
        }
        if !self.batch.points.is_empty() {
            (self.sink)(&self.batch)?;
        }
        self.batch.points.clear();
        self.batch.scans.clear();
        Ok(())
    }

    /// Hand on the rest.
    fn finish(mut self) -> Result<Skipped> {
        self.flush()?;
        Ok(self.skipped)
    }
}

/// Whether a coordinate can be on Earth. Also false for NaN.
#[inline]
fn is_somewhere(value: &f64) -> bool {
    value.abs() <= FARTHEST
}

/// Run a decoder of another crate that may panic on damaged data, and call such a panic damaged data.
fn guarded<T>(input: &Input, decode: impl FnOnce() -> Result<T>) -> Result<T> {
    let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(decode));
    outcome.unwrap_or_else(|_| Err(input.bad("the data is damaged: its decoder gave up")))
}
