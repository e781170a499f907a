//! The lattice of voxels, anchored at the origin: which brick, which voxel in it, and where in the voxel a point falls.

use std::ops::Range;

use crate::brick::SIDE_BITS;

/// Length of one quantum, m: all coordinates are rounded to a multiple of it.
pub const QUANTUM: f64 = 1e-4;
/// Coordinates beyond this size (m) are refused, or, of voxels below 5 cm, beyond 2^31 voxels.
pub const MAX_COORDINATE: f64 = 1e8;

/// Points that are located together: few enough to stay in the first cache.
pub(crate) const BLOCK: usize = 512;

/// Where some points fall.
pub(crate) struct Located {
    /// Index of the voxel of each.
    voxels: [[i32; 3]; BLOCK],
    /// From the voxel's lower corner, in quanta.
    offsets: [[u32; 3]; BLOCK],
}

impl Located {
    /// Room for a block.
    pub fn new() -> Self {
        Self { voxels: [[0; 3]; BLOCK], offsets: [[0; 3]; BLOCK] }
    }

    /// The index of a point's brick.
    #[inline]
    pub fn brick(&self, point: usize) -> [i32; 3] {
        self.voxels[point].map(|voxel| voxel >> SIDE_BITS)
    }

    /// Of the first points of a range that lie in a brick: the number of the voxel within it, and where in the voxel.
    #[inline]
    pub fn places(&self, points: Range<usize>, brick: [i32; 3]) -> impl Iterator<Item = (u16, [u32; 3])> {
        let corner = brick.map(|index| index << SIDE_BITS);
        self.voxels[points.clone()].iter().zip(&self.offsets[points]).map_while(move |(voxel, &offset)| {
            let [x, y, z] = std::array::from_fn(|axis| (voxel[axis] ^ corner[axis]) as u32);
            ((x | y | z) >> SIDE_BITS == 0).then_some(((x << (2 * SIDE_BITS) | y << SIDE_BITS | z) as u16, offset))
        })
    }
}

/// Turns coordinates into voxels.
pub(crate) struct Lattice {
    quanta: f64,
    voxels_per_quantum: f64,
    /// Points of a voxel, of which 32 bits hold all sums.
    pub most: u32,
    /// From the quantum that was met to the middle of its voxel, as rounding wants it.
    to_middle: f64,
    /// The largest quantum, either way.
    farthest: f64,
}

impl Lattice {
    /// Of voxels of so many quanta.
    pub fn new(quanta: u32) -> Self {
        let most = u32::MAX / ((quanta - 1) * (quanta - 1));
        let quanta = f64::from(quanta);
        let farthest = (MAX_COORDINATE / QUANTUM).min(f64::from(i32::MAX) * quanta);
        Self { quanta, most, voxels_per_quantum: quanta.recip(), to_middle: 0.5 * quanta.recip() - 0.5, farthest }
    }

    /// Whether a point is finite and not too far away.
    pub fn holds(&self, point: &[f64; 3]) -> bool {
        point.iter().all(|value| round(value * QUANTUM.recip()).abs() <= self.farthest) // false for NaN
    }

    /// Find the voxels of a block of points, all of which the lattice must hold; if it does not, this says false.
    ///
    /// One plain loop over all coordinates, without branches, so that the compiler takes several at once. Offsets are
    /// left out if nobody `wants_offsets`.
    #[inline]
    pub fn locate(&self, points: &[[f64; 3]], located: &mut Located, wants_offsets: bool) -> bool {
        let mut are_held = true;
        let voxels = located.voxels.as_flattened_mut().iter_mut();
        let places = voxels.zip(located.offsets.as_flattened_mut());
        for (value, (voxel, offset)) in points.as_flattened().iter().zip(places) {
            let quantum = round(value * QUANTUM.recip());
            are_held &= quantum.abs() <= self.farthest; // false for NaN
            // The voxel is the floor of (quantum + 1/2) / quanta; that is half a quantum away from every whole number,
            // so that neither the product nor rounding what is half less can miss it.
            let index = round(quantum * self.voxels_per_quantum + self.to_middle);
            *voxel = low_bits(index) as i32;
            if wants_offsets {
                *offset = low_bits(quantum - index * self.quanta);
            }
        }
        are_held
    }
}

/// So large that the last bit of what is added to it is worth one.
const LARGE: f64 = 6_755_399_441_055_744.0; // 1.5 x 2^52

/// The nearest whole number (of two the even one) for sizes below 2^51. Where rounding instructions cannot be taken
/// for granted, this is many times as fast.
#[inline]
fn round(value: f64) -> f64 {
    value + LARGE - LARGE
}

/// The last 32 bits of a whole number below 2^51 in size.
#[inline]
fn low_bits(whole: f64) -> u32 {
    (whole + LARGE).to_bits() as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_that_of_the_standard_library() {
        let mut state = 1_u64;
        for i in 0..1_000_000_i64 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let value = match i % 3 {
                0 => i as f64 / 2.0 - 100_000.0,
                1 => (state >> 12) as f64 / (1_u64 << (state % 40)) as f64 - 1e3,
                _ => -((state >> 24) as f64) / (1_u64 << (state % 40)) as f64,
            };
            if value.abs() < 1e12 {
                let expected = value.round_ties_even();
                assert_eq!(round(value), expected, "{value}");
                assert_eq!(low_bits(expected), expected as i64 as u32, "{value}");
            }
        }
    }

    #[test]
    fn a_voxel_is_found_as_whole_numbers_find_it() {
        let mut state = 1_u64;
        for quanta in [100, 500, 777, 1_000, 50_000] {
            let (lattice, mut located) = (Lattice::new(quanta), Located::new());
            for _ in 0..100_000 {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                // Sizes from a metre to the farthest, and voxels' faces.
                let quantum = (state as i64 >> (24 + state % 30)).clamp(-1_000_000_000_000, 1_000_000_000_000);
                let quantum =
                    if state.is_multiple_of(2) { quantum } else { quantum - quantum.rem_euclid(i64::from(quanta)) };
                let voxel = quantum.div_euclid(i64::from(quanta));
                if i32::try_from(voxel).is_err() || quantum.abs() > 1_000_000_000_000 {
                    continue;
                }
                let point = [quantum as f64 * QUANTUM; 3];
                assert!(lattice.holds(&point) && lattice.locate(&[point], &mut located, true));
                let place = voxel as u16 & 7;
                assert_eq!(located.brick(0), [voxel as i32 >> SIDE_BITS; 3], "{quantum}");
                assert_eq!(
                    located.places(0..1, located.brick(0)).next(),
                    Some((place << 6 | place << 3 | place, [quantum.rem_euclid(i64::from(quanta)) as u32; 3]))
                );
            }
        }
    }
}
