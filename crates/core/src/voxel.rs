//! Voxel evidence: a small, mergeable summary of all points (section 3.1 of the paper, with moments added).
//!
//! Space is cut into cubic voxels, anchored at the origin of the input's frame. Each occupied voxel keeps the number
//! of its points and the sums and products of their offsets within it, as integers of 0.1 mm. Integers add up to the
//! same sums in any order, so the evidence of two clouds together is the sum of their evidences, bit for bit, on any
//! number of threads. Voxels live in bricks of 8 x 8 x 8, found by hash: memory follows the surface of the building,
//! and a stray a kilometre away costs one brick.

use rustc_hash::FxHashMap;

use crate::{Error, Result};

/// Length of one quantum, m: all coordinates are rounded to a multiple of it.
pub const QUANTUM: f64 = 1e-4;
/// Coordinates beyond this size (m) are refused: voxel indices stay within 32 bits, for voxels of 5 cm and more
pub const MAX_COORDINATE: f64 = 1e8;
const SIDE_BITS: u32 = 3;
/// Voxels along the side of a brick.
pub const SIDE: i32 = 1 << SIDE_BITS;
const BRICK_VOXELS: usize = 1 << (3 * SIDE_BITS);
/// Up to this many voxels a brick is searched through; with more it gets a table of its slots.
const SEARCHED_VOXELS: usize = 8;

/// Sums over the points of a voxel; offsets are from its lower corner, in quanta.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Moments {
    /// Number of points.
    pub count: u64,
    /// Sums of x, y and z.
    pub sum: [u64; 3],
    /// Sums of xx, xy and yy.
    pub products: [u64; 3],
}

impl Moments {
    #[inline]
    fn add_point(&mut self, [x, y, z]: [u64; 3]) {
        self.count += 1;
        for (sum, value) in self.sum.iter_mut().zip([x, y, z]) {
            *sum += value;
        }
        for (sum, value) in self.products.iter_mut().zip([x * x, x * y, y * y]) {
            *sum += value;
        }
    }

    fn add(&mut self, other: &Self) {
        self.count += other.count;
        for (sum, value) in self.sum.iter_mut().zip(other.sum) {
            *sum += value;
        }
        for (sum, value) in self.products.iter_mut().zip(other.products) {
            *sum += value;
        }
    }
}

/// 8 x 8 x 8 voxels; only the occupied ones take room.
#[derive(Debug, Clone, Default)]
struct Brick {
    /// Place of each occupied voxel within the brick (x, then y, then z), in order of arrival.
    places: Vec<u16>,
    moments: Vec<Moments>,
    /// Where each place stands in `moments`, plus one; made once the brick holds enough to need it.
    slots: Option<Box<[u16; BRICK_VOXELS]>>,
    /// Scans that hit the brick, as indices into the evidence's own list, each once.
    scans: Vec<u32>,
}

impl Brick {
    #[inline]
    fn voxel(&mut self, place: u16) -> &mut Moments {
        let slot = match &self.slots {
            Some(slots) => usize::from(slots[usize::from(place)]),
            None => self.places.iter().position(|&p| p == place).map_or(0, |i| i + 1),
        };
        let index = if slot > 0 { slot - 1 } else { self.insert(place) };
        &mut self.moments[index]
    }

    #[cold]
    fn insert(&mut self, place: u16) -> usize {
        self.places.push(place);
        self.moments.push(Moments::default());
        let index = self.moments.len() - 1;
        if let Some(slots) = &mut self.slots {
            slots[usize::from(place)] = index as u16 + 1;
        } else if self.places.len() > SEARCHED_VOXELS {
            let mut slots = Box::new([0; BRICK_VOXELS]);
            for (i, &p) in self.places.iter().enumerate() {
                slots[usize::from(p)] = i as u16 + 1;
            }
            self.slots = Some(slots);
        }
        index
    }

    #[inline]
    fn note_scan(&mut self, scan: u32) {
        if self.scans.last() != Some(&scan) && !self.scans.contains(&scan) {
            self.scans.push(scan);
        }
    }
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
    /// Sums over its points.
    pub moments: Moments,
}

/// The summary of a cloud. See the module's text.
#[derive(Debug, Clone)]
pub struct Evidence {
    quanta: u32,
    bricks: FxHashMap<[i32; 3], Brick>,
    scans: Vec<ScanEvidence>,
    scan_index: FxHashMap<String, u32>,
    points: u64,
}

impl Evidence {
    /// No evidence yet, on a lattice of voxels of `voxel` metres.
    ///
    /// # Errors
    /// [`Error::BadArgument`] unless `voxel` is a multiple of 0.1 mm from 1 cm to 5 m.
    pub fn new(voxel: f64) -> Result<Self> {
        let quanta = (voxel / QUANTUM).round();
        if !(100.0..=50_000.0).contains(&quanta) || (quanta * QUANTUM - voxel).abs() > 1e-9 {
            return Err(Error::BadArgument(format!(
                "voxel size {voxel} m: expected a multiple of 0.0001 m from 0.01 to 5"
            )));
        }
        Ok(Self {
            quanta: quanta as u32,
            bricks: FxHashMap::default(),
            scans: Vec::new(),
            scan_index: FxHashMap::default(),
            points: 0,
        })
    }

    /// Side of a voxel, m.
    pub fn voxel(&self) -> f64 {
        f64::from(self.quanta) * QUANTUM
    }

    /// Points that came in.
    pub fn points(&self) -> u64 {
        self.points
    }

    /// Number of occupied voxels.
    pub fn len(&self) -> usize {
        self.bricks.values().map(|brick| brick.places.len()).sum()
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

    /// The index by which [`Evidence::add`] knows a scan; made on first use.
    pub fn scan(&mut self, key: &str, position: Option<[f64; 3]>) -> u32 {
        if let Some(&index) = self.scan_index.get(key) {
            let known = &mut self.scans[index as usize].position;
            *known = known.or(position);
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
        let mut too_far = 0;
        let mut rest = points;
        // Points come in runs that fall into one brick: the brick is looked up once a run.
        while let Some(&first) = rest.first() {
            let Some(located) = lattice.locate(first) else {
                too_far += 1;
                rest = &rest[1..];
                continue;
            };
            let brick = self.bricks.entry(located.brick).or_default();
            brick.note_scan(scan);
            brick.voxel(located.place).add_point(located.offset);
            let mut taken = 1;
            while let Some(next) = rest.get(taken).and_then(|&point| lattice.locate(point)) {
                if next.brick != located.brick {
                    break;
                }
                brick.voxel(next.place).add_point(next.offset);
                taken += 1;
            }
            rest = &rest[taken..];
        }
        let kept = points.len() as u64 - too_far;
        self.points += kept;
        self.scans[scan as usize].points += kept;
        too_far
    }

    /// Add all that another evidence holds; the result is that of both clouds together.
    ///
    /// # Errors
    /// [`Error::BadArgument`] when the two were gathered at different voxel sizes.
    pub fn merge(&mut self, other: &Self) -> Result<()> {
        if self.quanta != other.quanta {
            return Err(Error::BadArgument(format!(
                "cannot merge evidence of {} m voxels with evidence of {} m voxels",
                self.voxel(),
                other.voxel()
            )));
        }
        let scans: Vec<u32> = other
            .scans
            .iter()
            .map(|scan| {
                let index = self.scan(&scan.key, scan.position);
                self.scans[index as usize].points += scan.points;
                index
            })
            .collect();
        for (key, theirs) in &other.bricks {
            let ours = self.bricks.entry(*key).or_default();
            for (&place, moments) in theirs.places.iter().zip(&theirs.moments) {
                ours.voxel(place).add(moments);
            }
            for &scan in &theirs.scans {
                ours.note_scan(scans[scan as usize]);
            }
        }
        self.points += other.points;
        Ok(())
    }

    /// The occupied voxels, sorted by index (x, then y, then z).
    pub fn voxels(&self) -> Vec<Voxel> {
        let mut voxels = Vec::with_capacity(self.len());
        for (key, brick) in &self.bricks {
            for (&place, &moments) in brick.places.iter().zip(&brick.moments) {
                let place = i32::from(place);
                let within = [place >> (2 * SIDE_BITS), (place >> SIDE_BITS) & (SIDE - 1), place & (SIDE - 1)];
                let index = std::array::from_fn(|axis| (key[axis] << SIDE_BITS) + within[axis]);
                voxels.push(Voxel { index, moments });
            }
        }
        voxels.sort_unstable_by_key(|voxel| voxel.index);
        voxels
    }

    /// Which scans hit which brick: brick index (voxel index divided by [`SIDE`]) and index into [`Evidence::scans`],
    /// sorted.
    pub fn brick_scans(&self) -> Vec<([i32; 3], u32)> {
        let mut order: Vec<usize> = (0..self.scans.len()).collect();
        order.sort_by(|&a, &b| self.scans[a].key.cmp(&self.scans[b].key));
        let mut rank = vec![0; order.len()];
        for (place, &scan) in order.iter().enumerate() {
            rank[scan] = place as u32;
        }
        let mut hits: Vec<_> = self
            .bricks
            .iter()
            .flat_map(|(&key, brick)| brick.scans.iter().map(move |&scan| (key, scan)))
            .map(|(key, scan)| (key, rank[scan as usize]))
            .collect();
        hits.sort_unstable();
        hits
    }
}

/// Where a point falls.
struct Located {
    brick: [i32; 3],
    place: u16,
    offset: [u64; 3],
}

/// Turns coordinates into voxels.
struct Lattice {
    quanta: i64,
    voxels_per_quantum: f64,
}

impl Lattice {
    fn new(quanta: u32) -> Self {
        Self { quanta: i64::from(quanta), voxels_per_quantum: f64::from(quanta).recip() }
    }

    /// None for what is not finite or too far away.
    #[inline]
    fn locate(&self, point: [f64; 3]) -> Option<Located> {
        let mut brick = [0; 3];
        let mut place = 0;
        let mut offset = [0; 3];
        for axis in 0..3 {
            let quantised = (point[axis] * QUANTUM.recip()).round_ties_even();
            if quantised.is_nan() || quantised.abs() > MAX_COORDINATE / QUANTUM {
                return None;
            }
            // Half a quantum away from every voxel's face, the product cannot round across one.
            let voxel = ((quantised + 0.5) * self.voxels_per_quantum).floor() as i64;
            offset[axis] = (quantised as i64 - voxel * self.quanta) as u64;
            let voxel = voxel as i32;
            brick[axis] = voxel >> SIDE_BITS;
            place = (place << SIDE_BITS) | (voxel & (SIDE - 1)) as u16;
        }
        Some(Located { brick, place, offset })
    }
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
        let mut evidence = Evidence::new(0.05).unwrap();
        let scan = evidence.scan(key, None);
        assert_eq!(evidence.add(points, scan), 0);
        evidence
    }

    #[test]
    fn a_merged_evidence_is_that_of_both_clouds_in_any_order() {
        let points = cloud(5_000);
        let whole = evidence(&points, "a");
        let (first, second) = (evidence(&points[..1_234], "a"), evidence(&points[1_234..], "a"));
        for (mut left, right) in [(first.clone(), &second), (second.clone(), &first)] {
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
        let mut evidence = Evidence::new(0.05).unwrap();
        let scan = evidence.scan("a", None);
        assert_eq!(evidence.add(&[[f64::NAN, 0.0, 0.0], [0.0, f64::INFINITY, 0.0], [0.0, 0.0, -2e8]], scan), 3);
        assert!(evidence.is_empty());
    }

    #[test]
    fn evidence_of_different_voxels_does_not_merge() {
        let mut fine = Evidence::new(0.05).unwrap();
        assert!(fine.merge(&Evidence::new(0.1).unwrap()).is_err());
        assert!(Evidence::new(0.0).is_err());
        assert!(Evidence::new(0.01234567).is_err());
    }
}
