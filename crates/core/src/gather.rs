//! One pass over the points of many files: files and their parts side by side, evidence the same for any number of
//! threads.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rayon::prelude::*;

use crate::read::{Batch, Header, Skipped, Source, open};
use crate::voxel::Evidence;
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

/// How far a pass has come, and whether it should stop; shared with whoever watches.
#[derive(Debug, Default)]
pub struct Progress {
    /// Points decoded so far.
    pub points: AtomicU64,
    /// Set to make the pass end early with [`Error::Interrupted`].
    pub stop: AtomicBool,
}

/// What one file gave.
#[derive(Debug)]
pub struct FileReport {
    /// The file.
    pub path: PathBuf,
    /// What was left out, or why nothing of the file came in.
    pub outcome: Result<Skipped>,
}

/// Gather the evidence of all files. A file comes in whole or, if any of it is bad, not at all.
///
/// # Errors
/// [`Error::BadArgument`] for a bad voxel size, [`Error::Interrupted`] when told to stop. What is wrong with a file is
/// in its report.
pub fn gather(
    paths: &[PathBuf],
    voxel: f64,
    frame: Frame,
    threads: usize,
    progress: &Progress,
) -> Result<(Evidence, Vec<FileReport>)> {
    let total = Mutex::new(Evidence::new(voxel)?);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| Error::BadArgument(format!("cannot start {threads} threads: {error}")))?;
    let reports = pool.install(|| {
        paths
            .par_iter()
            .with_max_len(1)
            .map(|path| {
                let outcome = gather_file(path, voxel, frame, progress).and_then(|(evidence, skipped)| {
                    total.lock().expect("no thread panics while it holds the lock").merge(&evidence)?;
                    Ok(skipped)
                });
                FileReport { path: path.clone(), outcome }
            })
            .collect()
    });
    if progress.stop.load(Ordering::Relaxed) {
        return Err(Error::Interrupted);
    }
    Ok((total.into_inner().expect("no thread panics while it holds the lock"), reports))
}

/// The evidence of one file, its parts decoded side by side on the current thread pool.
fn gather_file(path: &Path, voxel: f64, frame: Frame, progress: &Progress) -> Result<(Evidence, Skipped)> {
    let source = open(path)?;
    let empty = Evidence::new(voxel)?;
    let (evidence, skipped) = (0..source.parts())
        .into_par_iter()
        .try_fold(
            || (empty.clone(), Skipped::default()),
            |(mut evidence, skipped), part| {
                let more = add_part(source.as_ref(), part, frame, &mut evidence, progress)?;
                Ok((evidence, sum(skipped, more)))
            },
        )
        .try_reduce(
            || (empty.clone(), Skipped::default()),
            |(left, a), (right, b)| {
                let (mut large, small) = if left.len() >= right.len() { (left, right) } else { (right, left) };
                large.merge(&small)?;
                Ok((large, sum(a, b)))
            },
        )?;
    source.header().check(path, evidence.points() + skipped.invalid + skipped.not_finite)?;
    Ok((evidence, skipped))
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
            let (key, position) = scan_identity(source.header(), number);
            let scan = evidence.scan(&key, position.map(|p| frame.apply(p)));
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
