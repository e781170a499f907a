//! Voxel evidence: a small, mergeable summary of all points (section 3.1 of the paper, with moments added).
//!
//! Space is cut into cubic voxels, anchored at the origin of the input's frame. Each occupied voxel keeps the number
//! of its points and the sums and products of their offsets within it, as integers of 0.1 mm; or, if only occupancy is
//! wanted, one bit. Integers add up to the same sums in any order, so the evidence of two clouds together is the sum
//! of their evidences, bit for bit, on any number of threads. Voxels live in bricks of 8 x 8 x 8, found by hash: memory
//! follows the surface of the building, and a stray a kilometre away costs one brick.

use std::cmp::Ordering;
use std::collections::hash_map::Entry;
use std::ops::Range;

use rustc_hash::FxHashMap;

use crate::brick::{Bits, Cells, SIDE_BITS, Sums};
pub use crate::brick::{Moments, SIDE};
use crate::lattice::{BLOCK, Lattice, Located};
pub use crate::lattice::{MAX_COORDINATE, QUANTUM};
use crate::{Error, Result};

/// Quanta along the side of a voxel: 1 cm to 5 m.
pub(crate) const VOXEL_QUANTA: std::ops::RangeInclusive<u32> = 100..=50_000;

/// What is kept of the points in a voxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kept {
    /// Their number, and the sums and products of their offsets.
    Moments,
    /// That there are some.
    Occupancy,
}

/// What is known of one scan (setup).
#[derive(Debug, Clone, PartialEq)]
pub struct ScanEvidence {
    /// A key made from what the scan is, never from the order of files.
    pub key: String,
    /// Where the scanner stood, m, in the frame of the evidence.
    pub position: Option<[f64; 3]>,
    /// Points that came in.
    pub points: u64,
}

/// One occupied voxel, as handed out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Voxel {
    /// Index of the voxel: its lower corner divided by the voxel size.
    pub index: [i32; 3],
    /// Sums over its points; all zero if only occupancy was kept.
    pub moments: Moments,
}

/// A brick's voxels, and the scans that hit it: indices into the evidence's own list, each once.
#[derive(Debug, Clone, Default)]
pub(crate) struct Brick<C> {
    pub cells: C,
    pub scans: Vec<u32>,
}

impl<C> Brick<C> {
    #[inline]
    pub fn note_scan(&mut self, scan: u32) {
        if self.scans.last() != Some(&scan) && !self.scans.contains(&scan) {
            self.scans.reserve_exact(1); // most bricks are hit by few
            self.scans.push(scan);
        }
    }
}

/// Bricks by their index: that of their voxels divided by [`SIDE`].
pub(crate) type Bricks<C> = FxHashMap<[i32; 3], Brick<C>>;

#[derive(Debug, Clone)]
pub(crate) enum Space {
    Moments(Bricks<Sums>),
    Occupancy(Bricks<Bits>),
}

/// The same for either kind of bricks.
macro_rules! with_bricks {
    ($space:expr, $bricks:ident => $result:expr) => {
        match $space {
            Space::Moments($bricks) => $result,
            Space::Occupancy($bricks) => $result,
        }
    };
}
pub(crate) use with_bricks;

/// The summary of a cloud. See the module's text.
#[derive(Debug, Clone)]
pub struct Evidence {
    quanta: u32,
    pub(crate) space: Space,
    scans: Vec<ScanEvidence>,
    scan_index: FxHashMap<String, u32>,
    points: u64,
}

impl Evidence {
    /// No evidence yet, on a lattice of voxels of `voxel` metres.
    ///
    /// # Errors
    /// [`Error::BadArgument`] unless `voxel` is a multiple of 0.1 mm from 1 cm to 5 m.
    pub fn new(voxel: f64, kept: Kept) -> Result<Self> {
        let quanta = (voxel / QUANTUM).round();
        if !VOXEL_QUANTA.contains(&(quanta as u32)) || (quanta * QUANTUM - voxel).abs() > 1e-9 {
            return Err(Error::BadArgument(format!(
                "voxel size {voxel} m: expected a multiple of 0.0001 m from 0.01 to 5"
            )));
        }
        Ok(Self::with_quanta(quanta as u32, kept))
    }

    /// The same, of voxels of so many quanta.
    pub(crate) fn with_quanta(quanta: u32, kept: Kept) -> Self {
        let space = match kept {
            Kept::Moments => Space::Moments(Bricks::default()),
            Kept::Occupancy => Space::Occupancy(Bricks::default()),
        };
        Self { quanta, space, scans: Vec::new(), scan_index: FxHashMap::default(), points: 0 }
    }

    /// Side of a voxel, m.
    pub fn voxel(&self) -> f64 {
        f64::from(self.quanta) * QUANTUM
    }

    /// Side of a voxel, quanta.
    pub(crate) fn quanta(&self) -> u32 {
        self.quanta
    }

    /// What is kept of the points in a voxel.
    pub fn kept(&self) -> Kept {
        match self.space {
            Space::Moments(_) => Kept::Moments,
            Space::Occupancy(_) => Kept::Occupancy,
        }
    }

    /// Points that came in.
    pub fn points(&self) -> u64 {
        self.points
    }

    /// Number of occupied voxels.
    pub fn len(&self) -> usize {
        with_bricks!(&self.space, bricks => bricks.values().map(|brick| brick.cells.len()).sum())
    }

    /// Number of bricks that hold any.
    pub fn bricks(&self) -> usize {
        with_bricks!(&self.space, bricks => bricks.len())
    }

    /// Whether no point came in.
    pub fn is_empty(&self) -> bool {
        self.points == 0
    }

    /// The scans, sorted by key.
    pub fn scans(&self) -> Vec<ScanEvidence> {
        let mut scans = self.scans.clone();
        scans.sort_by(|a, b| a.key.cmp(&b.key));
        scans
    }

    /// For each scan of the evidence's own list, its place in [`Evidence::scans`].
    pub(crate) fn scan_ranks(&self) -> Vec<u32> {
        let mut order: Vec<usize> = (0..self.scans.len()).collect();
        order.sort_by(|&a, &b| self.scans[a].key.cmp(&self.scans[b].key));
        let mut ranks = vec![0; order.len()];
        for (rank, &scan) in (0..).zip(&order) {
            ranks[scan] = rank;
        }
        ranks
    }

    /// The index by which [`Evidence::add`] knows a scan; made on first use. Of two positions for one key the smaller
    /// one is kept, so that the order does not matter.
    pub fn scan(&mut self, key: &str, position: Option<[f64; 3]>) -> u32 {
        if let Some(&index) = self.scan_index.get(key) {
            let known = &mut self.scans[index as usize].position;
            *known = match (*known, position) {
                (Some(one), Some(other)) => Some(if is_before(&other, &one) { other } else { one }),
                (one, other) => one.or(other),
            };
            return index;
        }
        let index = self.scans.len() as u32;
        self.scans.push(ScanEvidence { key: key.to_owned(), position, points: 0 });
        self.scan_index.insert(key.to_owned(), index);
        index
    }

    /// Add points of one scan (m, in the frame of the evidence). Points beyond [`MAX_COORDINATE`] are left out; their
    /// number is returned.
    pub fn add(&mut self, points: &[[f64; 3]], scan: u32) -> u64 {
        let lattice = Lattice::new(self.quanta);
        let too_far = with_bricks!(&mut self.space, bricks => add_points(bricks, points, scan, &lattice));
        self.count(points.len() as u64 - too_far, scan);
        too_far
    }

    /// Note that points of a scan came in.
    pub(crate) fn count(&mut self, points: u64, scan: u32) {
        self.points = self.points.saturating_add(points);
        let scan = &mut self.scans[scan as usize];
        scan.points = scan.points.saturating_add(points);
    }

    /// Add all that another evidence holds; the result is that of both clouds together.
    ///
    /// # Errors
    /// [`Error::BadArgument`] when the two were gathered at different voxel sizes, or keep different things.
    pub fn merge(&mut self, other: Self) -> Result<()> {
        if self.quanta != other.quanta {
            return Err(Error::BadArgument(format!(
                "cannot merge evidence of {} m voxels with evidence of {} m voxels",
                self.voxel(),
                other.voxel()
            )));
        }
        if self.kept() != other.kept() {
            let message = "cannot merge evidence of occupancy alone with evidence that keeps moments";
            return Err(Error::BadArgument(message.into()));
        }
        let mut scans = Vec::with_capacity(other.scans.len());
        for scan in &other.scans {
            let index = self.scan(&scan.key, scan.position);
            self.count(scan.points, index);
            scans.push(index);
        }
        match (&mut self.space, other.space) {
            (Space::Moments(ours), Space::Moments(theirs)) => merge_bricks(ours, theirs, &scans),
            (Space::Occupancy(ours), Space::Occupancy(theirs)) => merge_bricks(ours, theirs, &scans),
            _ => {} // told apart above
        }
        Ok(())
    }

    /// The occupied voxels, sorted by index (x, then y, then z).
    pub fn voxels(&self) -> Vec<Voxel> {
        let mut voxels = Vec::with_capacity(self.len());
        self.each_voxel(|voxel| voxels.push(voxel));
        voxels
    }

    /// Hand on the occupied voxels, sorted by index.
    pub fn each_voxel(&self, mut take: impl FnMut(Voxel)) {
        with_bricks!(&self.space, bricks => {
            let mut bricks: Vec<_> = bricks.iter().collect();
            bricks.sort_unstable_by_key(|(key, _)| **key);
            let mut slab = Slab::default();
            for (&key, brick) in bricks {
                slab.add(key, &mut take, |voxels| brick.cells.each(|place, &moments| voxels.push((place, moments))));
            }
            slab.hand_on(&mut take);
        });
    }

    /// Which scans hit which brick: brick index (voxel index divided by [`SIDE`]) and index into [`Evidence::scans`],
    /// sorted.
    pub fn brick_scans(&self) -> Vec<([i32; 3], u32)> {
        let (ranks, mut hits) = (self.scan_ranks(), Vec::new());
        with_bricks!(&self.space, bricks => for (&key, brick) in bricks {
            hits.extend(brick.scans.iter().map(|&scan| (key, ranks[scan as usize])));
        });
        hits.sort_unstable();
        hits
    }
}

/// Bricks that share their first index: their voxels are put in order together, so that what is moved stays in the cache.
#[derive(Default)]
pub(crate) struct Slab {
    /// Place in its brick, and sums, of each voxel, brick after brick.
    voxels: Vec<(u16, Moments)>,
    /// The bricks, and which of their voxels were not handed on.
    bricks: Vec<([i32; 3], Range<usize>)>,
}

impl Slab {
    /// Add a brick, whose voxels `fill` pushes in the order of their places; bricks come in order. With the first of the
    /// next slab the voxels of this one are handed on.
    pub fn add(&mut self, key: [i32; 3], take: impl FnMut(Voxel), fill: impl FnOnce(&mut Vec<(u16, Moments)>)) {
        if self.bricks.last().is_some_and(|(last, _)| last[0] != key[0]) {
            self.hand_on(take);
        }
        let first = self.voxels.len();
        fill(&mut self.voxels);
        self.bricks.push((key, first..self.voxels.len()));
    }

    /// Hand on the voxels, sorted by index, and forget them.
    pub fn hand_on(&mut self, mut take: impl FnMut(Voxel)) {
        // Of each brick the next column, row after row.
        for x in 0..SIDE {
            for row in self.bricks.chunk_by_mut(|(one, _), (other, _)| one[1] == other[1]) {
                for y in 0..SIDE {
                    let column = (x << SIDE_BITS | y) as u16;
                    for (key, left) in &mut *row {
                        while left.start < left.end && self.voxels[left.start].0 >> SIDE_BITS == column {
                            let (place, moments) = self.voxels[left.start];
                            let within = [x, y, i32::from(place) & (SIDE - 1)];
                            let index = std::array::from_fn(|axis| (key[axis] << SIDE_BITS) + within[axis]);
                            take(Voxel { index, moments });
                            left.start += 1;
                        }
                    }
                }
            }
        }
        self.voxels.clear();
        self.bricks.clear();
    }
}

/// Add points of a scan; returns how many are too far away.
fn add_points<C: Cells>(bricks: &mut Bricks<C>, points: &[[f64; 3]], scan: u32, lattice: &Lattice) -> u64 {
    let (mut located, mut too_far) = (Located::new(), 0);
    for block in points.chunks(BLOCK) {
        if lattice.locate(block, &mut located, C::WANTS_OFFSETS) {
            add_located(bricks, &located, block.len(), scan, lattice.most);
        } else {
            let near: Vec<_> = block.iter().copied().filter(|point| lattice.holds(point)).collect();
            too_far += (block.len() - near.len()) as u64;
            lattice.locate(&near, &mut located, C::WANTS_OFFSETS);
            add_located(bricks, &located, near.len(), scan, lattice.most);
        }
    }
    too_far
}

/// Points come in runs that fall into one brick: the brick is looked up once a run.
fn add_located<C: Cells>(bricks: &mut Bricks<C>, located: &Located, count: usize, scan: u32, most: u32) {
    let mut point = 0;
    while point < count {
        let index = located.brick(point);
        let brick = bricks.entry(index).or_default();
        brick.note_scan(scan);
        let places = located.places(point..count, index).inspect(|_| point += 1);
        brick.cells.add_points(places, most);
    }
}

/// Bricks that only they have are taken over as they are. `scans` says which of our scans each of theirs is.
fn merge_bricks<C: Cells>(ours: &mut Bricks<C>, theirs: Bricks<C>, scans: &[u32]) {
    for (key, mut brick) in theirs {
        brick.scans.iter_mut().for_each(|scan| *scan = scans[*scan as usize]);
        match ours.entry(key) {
            Entry::Vacant(place) => {
                place.insert(brick);
            }
            Entry::Occupied(mut known) => {
                known.get_mut().cells.merge(&brick.cells);
                brick.scans.iter().for_each(|&scan| known.get_mut().note_scan(scan));
            }
        }
    }
}

/// An order of positions that knows no equals but the same bits.
fn is_before(one: &[f64; 3], other: &[f64; 3]) -> bool {
    let order = one.iter().zip(other).map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne());
    order == Some(Ordering::Less)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(count: usize) -> Vec<[f64; 3]> {
        let mut state = 1_u64;
        let mut uniform = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..count).map(|_| [500_000.0 + 3.0 * uniform(), 4.0 * uniform() - 2.0, uniform()]).collect()
    }

    fn evidence(points: &[[f64; 3]], key: &str) -> Evidence {
        let mut evidence = Evidence::new(0.05, Kept::Moments).unwrap();
        let scan = evidence.scan(key, None);
        assert_eq!(evidence.add(points, scan), 0);
        evidence
    }

    #[test]
    fn a_merged_evidence_is_that_of_both_clouds_in_any_order() {
        let points = cloud(5_000);
        let whole = evidence(&points, "a");
        let (first, second) = (evidence(&points[..1_234], "a"), evidence(&points[1_234..], "a"));
        for (mut left, right) in [(first.clone(), second.clone()), (second, first)] {
            left.merge(right).unwrap();
            assert_eq!(left.voxels(), whole.voxels());
            assert_eq!(left.brick_scans(), whole.brick_scans());
            assert_eq!(left.scans(), whole.scans());
        }
    }

    #[test]
    fn every_point_counts_in_the_voxel_that_holds_it() {
        let points = cloud(2_000);
        let voxels = evidence(&points, "a").voxels();
        assert_eq!(voxels.iter().map(|v| v.moments.count).sum::<u64>(), 2_000);
        // A tenth of a millimetre: the quantum.
        let expected: f64 = points.iter().map(|p| p[1]).sum();
        let found: f64 = voxels
            .iter()
            .map(|v| v.moments.count as f64 * f64::from(v.index[1]) * 0.05 + v.moments.sum[1] as f64 * QUANTUM)
            .sum();
        assert!((expected - found).abs() < 2_000.0 * QUANTUM, "{expected} {found}");
    }

    #[test]
    fn a_point_on_a_voxel_face_belongs_to_the_upper_voxel() {
        let voxels = evidence(&[[0.05, -0.05, 0.1]], "a").voxels();
        assert_eq!(voxels[0].index, [1, -1, 2]);
        assert_eq!(voxels[0].moments.sum, [0, 0, 0]);
    }

    #[test]
    fn points_out_of_reach_are_counted_and_left_out() {
        let mut evidence = Evidence::new(0.05, Kept::Moments).unwrap();
        let scan = evidence.scan("a", None);
        assert_eq!(evidence.add(&[[f64::NAN, 0.0, 0.0], [0.0, f64::INFINITY, 0.0], [0.0, 0.0, -2e8]], scan), 3);
        assert!(evidence.is_empty());
        // Finer voxels have indices of 32 bits as well.
        let mut fine = Evidence::new(0.01, Kept::Moments).unwrap();
        let scan = fine.scan("a", None);
        assert_eq!(fine.add(&[[2.1e7, 0.0, -2.1e7], [2.2e7, 0.0, 0.0], [0.0, -2.2e7, 0.0]], scan), 2);
        assert_eq!(fine.voxels()[0].index, [2_100_000_000, 0, -2_100_000_000]);
    }

    #[test]
    fn evidence_of_different_voxels_does_not_merge() {
        let mut fine = Evidence::new(0.05, Kept::Moments).unwrap();
        assert!(fine.merge(Evidence::new(0.1, Kept::Moments).unwrap()).is_err());
        assert!(Evidence::new(0.0, Kept::Moments).is_err());
        assert!(Evidence::new(0.01234567, Kept::Moments).is_err());
    }
}
