//! The lattice of voxels, anchored at the origin: which brick, which voxel in it, and where in the voxel a point falls.

use crate::brick::{SIDE, SIDE_BITS};

/// Length of one quantum, m: all coordinates are rounded to a multiple of it.
pub const QUANTUM: f64 = 1e-4;
/// Coordinates beyond this size (m) are refused: voxel indices stay within 32 bits, for voxels of 5 cm and more
pub const MAX_COORDINATE: f64 = 1e8;

/// Where a point falls.
pub(crate) struct Located {
    pub brick: [i32; 3],
    /// Number of the voxel within the brick.
    pub place: u16,
    /// From the voxel's lower corner, in quanta.
    pub offset: [u64; 3],
}

/// Turns coordinates into voxels.
pub(crate) struct Lattice {
    quanta: i64,
    voxels_per_quantum: f64,
    /// From the quantum that was met to the middle of its voxel, as rounding wants it.
    to_middle: f64,
}

impl Lattice {
    /// Of voxels of so many quanta.
    pub fn new(quanta: u32) -> Self {
        let voxels_per_quantum = f64::from(quanta).recip();
        Self { quanta: i64::from(quanta), voxels_per_quantum, to_middle: 0.5 * voxels_per_quantum - 0.5 }
    }

    /// None for what is not finite or too far away.
    #[inline]
    pub fn locate(&self, point: [f64; 3]) -> Option<Located> {
        let mut brick = [0; 3];
        let mut place = 0;
        let mut offset = [0; 3];
        for axis in 0..3 {
            let (quantised, quantum) = round(point[axis] * QUANTUM.recip());
            // Also false for NaN.
            let is_within = quantised.abs() <= MAX_COORDINATE / QUANTUM;
            if !is_within {
                return None;
            }
            // The voxel is the floor of (quantum + 1/2) / quanta; that is half a quantum away from every whole number,
            // so that neither the product nor rounding what is half less can miss it.
            let (_, voxel) = round(quantised * self.voxels_per_quantum + self.to_middle);
            offset[axis] = (quantum - voxel * self.quanta) as u64;
            let voxel = voxel as i32;
            brick[axis] = voxel >> SIDE_BITS;
            place = (place << SIDE_BITS) | (voxel & (SIDE - 1)) as u16;
        }
        Some(Located { brick, place, offset })
    }
}

/// The nearest whole number (of two the even one), as f64 and i64, for sizes below 2^51: so large a number is added that
/// its last bit is worth one. Where rounding instructions cannot be taken for granted, this is many times as fast.
#[inline]
fn round(value: f64) -> (f64, i64) {
    const LARGE: f64 = 6_755_399_441_055_744.0; // 1.5 x 2^52
    let shifted = value + LARGE;
    (shifted - LARGE, shifted.to_bits().wrapping_sub(LARGE.to_bits()) as i64)
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
                assert_eq!(round(value), (expected, expected as i64), "{value}");
            }
        }
    }

    #[test]
    fn a_voxel_is_found_as_whole_numbers_find_it() {
        let mut state = 1_u64;
        for quanta in [100, 500, 777, 1_000, 50_000] {
            let lattice = Lattice::new(quanta);
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
                let located = lattice.locate([quantum as f64 * QUANTUM; 3]).unwrap();
                let (brick, place) = (voxel as i32 >> SIDE_BITS, voxel as u16 & 7);
                assert_eq!((located.brick, located.place), ([brick; 3], place << 6 | place << 3 | place), "{quantum}");
                assert_eq!(located.offset, [quantum.rem_euclid(i64::from(quanta)) as u64; 3]);
            }
        }
    }
}
