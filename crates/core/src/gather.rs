//! One pass over the points of many files: files and their parts side by side, evidence the same for any number of
//! threads.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::read::{Batch, Header, Skipped, Source, open_known};
use crate::voxel::{Evidence, Kept};
use crate::{Error, Result};

/// From a file's frame and unit to the evidence's: metres, z up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Metres in one unit of the file.
    pub unit: f64,
    /// Signed axis (1, 2, 3 for x, y, z; negative for its opposite) of the file that becomes x, y and z.
    pub axes: [i8; 3],
}

impl Frame {
    /// Metres, z up: nothing to do.
    pub const IDENTITY: Self = Self { unit: 1.0, axes: [1, 2, 3] };

    /// A point of the file in the frame of the evidence.
    pub fn apply(&self, point: [f64; 3]) -> [f64; 3] {
        self.axes.map(|axis| f64::from(axis.signum()) * self.unit * point[usize::from(axis.unsigned_abs()) - 1])
    }
}

/// What to make of the points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Side of a voxel, m.
    pub voxel: f64,
    /// What is kept of the points in a voxel.
    pub kept: Kept,
    /// The frame that the files are in.
    pub frame: Frame,
    /// Of files that have levels of detail, read only those down to a spacing of half a voxel.
    pub preview: bool,
}

impl Options {
    fn open(&self, path: &Path, scan_ends: &[u64]) -> Result<Box<dyn Source>> {
        open_known(path, self.spacing(), scan_ends)
    }

    /// The spacing of points, in the files' unit, that is close enough.
    pub fn spacing(&self) -> Option<f64> {
        self.preview.then_some(self.voxel / 2.0 / self.frame.unit)
    }
}

/// How far a pass has come, and whether it should stop; shared with whoever watches.
#[derive(Debug, Default)]
pub struct Progress {
    /// Points decoded so far.
    pub points: AtomicU64,
    /// Set to make the pass end early with [`Error::Interrupted`].
    pub stop: AtomicBool,
}

/// A file to read.
#[derive(Debug, Clone)]
pub struct Given {
    /// Where it is.
    pub path: PathBuf,
    /// What [`Source::scan_ends`] told when it was opened before; empty if it was not.
    pub scan_ends: Vec<u64>,
}

/// What one file gave.
#[derive(Debug)]
pub struct FileReport {
    /// The file.
    pub path: PathBuf,
    /// What was left out, or why nothing of the file came in.
    pub outcome: Result<Skipped>,
}

/// Called with each file that is done: its number among the files, its evidence, and what was left out.
pub type OnFile<'a> = &'a (dyn Fn(usize, &Arc<Evidence>, Skipped) -> Result<()> + Sync);

/// Gather the evidence of all files. A file comes in whole or, if any of it is bad, not at all.
///
/// # Errors
/// [`Error::BadArgument`] for a bad voxel size, [`Error::Interrupted`] when told to stop. What is wrong with a file is
/// in its report.
pub fn gather(
    files: &[Given],
    options: &Options,
    threads: usize,
    progress: &Progress,
    on_file: OnFile<'_>,
) -> Result<(Evidence, Vec<FileReport>)> {
    let total = Mutex::new(Arc::new(Evidence::new(options.voxel, options.kept)?));
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| Error::BadArgument(format!("cannot start {threads} threads: {error}")))?;
    let gather_one = |number: usize, file: &Given| {
        let (evidence, skipped) = gather_file(file, options, progress)?;
        let evidence = Arc::new(evidence);
        on_file(number, &evidence, skipped)?;
        let mut total = total.lock().unwrap_or_else(PoisonError::into_inner);
        if total.is_empty() {
            *total = evidence;
        } else {
            Arc::make_mut(&mut total).merge(Arc::unwrap_or_clone(evidence))?;
        }
        Ok(skipped)
    };
    let reports = pool.install(|| {
        files
            .par_iter()
            .enumerate()
            .with_max_len(1)
            .map(|(number, file)| FileReport { path: file.path.clone(), outcome: gather_one(number, file) })
            .collect()
    });
    if progress.stop.load(Ordering::Relaxed) {
        return Err(Error::Interrupted);
    }
    let total = total.into_inner().unwrap_or_else(PoisonError::into_inner);
    Ok((Arc::unwrap_or_clone(total), reports))
}

/// The evidence of one file, its parts decoded side by side on the current thread pool.
fn gather_file(file: &Given, options: &Options, progress: &Progress) -> Result<(Evidence, Skipped)> {
    let source = options.open(&file.path, &file.scan_ends)?;
    let (evidence, skipped) = gather_source(source.as_ref(), 0..source.parts(), options, progress)?;
    source.header().check(&file.path, evidence.points() + skipped.invalid + skipped.not_finite)?;
    Ok((evidence, skipped))
}

/// The evidence of some parts of a file; whether the file is whole is for the caller to check
/// (see [`Header::check`]).
///
/// # Errors
/// As [`gather`], and whatever is wrong with the file.
pub fn gather_parts(path: &Path, parts: Range<usize>, options: &Options) -> Result<(Evidence, Skipped)> {
    let source = options.open(path, &[])?;
    let end = parts.end.min(source.parts());
    gather_source(source.as_ref(), parts.start..end, options, &Progress::default())
}

/// One evidence for each thread, however many the parts are: memory does not grow with the file.
fn gather_source(
    source: &dyn Source,
    parts: Range<usize>,
    options: &Options,
    progress: &Progress,
) -> Result<(Evidence, Skipped)> {
    let empty = || Evidence::new(options.voxel, options.kept);
    let next = AtomicUsize::new(parts.start);
    (0..rayon::current_num_threads().min(parts.len()))
        .into_par_iter()
        .with_max_len(1)
        .map(|_| {
            let (mut evidence, mut skipped) = (empty()?, Skipped::default());
            loop {
                let part = next.fetch_add(1, Ordering::Relaxed);
                if part >= parts.end {
                    return Ok((evidence, skipped));
                }
                let more = add_part(source, part, options.frame, &mut evidence, progress);
                // One bad part is enough: the others need not be read.
                skipped = sum(skipped, more.inspect_err(|_| next.store(parts.end, Ordering::Relaxed))?);
            }
        })
        .try_reduce_with(|(left, a), (right, b)| {
            let (mut large, small) = if left.bricks() >= right.bricks() { (left, right) } else { (right, left) };
            large.merge(small)?;
            Ok((large, sum(a, b)))
        })
        .unwrap_or_else(|| Ok((empty()?, Skipped::default())))
}

fn add_part(
    source: &dyn Source,
    part: usize,
    frame: Frame,
    evidence: &mut Evidence,
    progress: &Progress,
) -> Result<Skipped> {
    let mut too_far = 0;
    let mut moved = Vec::new();
    let mut known = FxHashMap::default();
    let mut skipped = source.read(part, &mut |batch: &Batch| {
        if progress.stop.load(Ordering::Relaxed) {
            return Err(Error::Interrupted);
        }
        let points = if frame == Frame::IDENTITY {
            &batch.points
        } else {
            moved.clear();
            moved.extend(batch.points.iter().map(|&point| frame.apply(point)));
            &moved
        };
        let mut start = 0;
        while start < points.len() {
            let number = batch.scans.get(start).copied().unwrap_or(batch.scan);
            let run = batch.scans[start.min(batch.scans.len())..].iter().take_while(|&&scan| scan == number).count();
            let end = if run == 0 { points.len() } else { start + run };
            let scan = *known.entry(number).or_insert_with(|| {
                let (key, position) = scan_identity(source.header(), number);
                evidence.scan(&key, position.map(|p| frame.apply(p)))
            });
            too_far += evidence.add(&points[start..end], scan);
            start = end;
        }
        progress.points.fetch_add(points.len() as u64, Ordering::Relaxed);
        Ok(())
    })?;
    skipped.not_finite += too_far;
    Ok(skipped)
}

/// What a scan is known by, and where its scanner stood.
fn scan_identity(header: &Header, number: u32) -> (String, Option<[f64; 3]>) {
    let position = header.scans.iter().find(|scan| scan.number == number).and_then(|scan| scan.position);
    (header.scan_key(number), position)
}

fn sum(a: Skipped, b: Skipped) -> Skipped {
    Skipped { invalid: a.invalid + b.invalid, not_finite: a.not_finite + b.not_finite }
}
