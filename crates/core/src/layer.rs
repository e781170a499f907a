//! The voxels between two heights, about an origin near their middle.

use crate::coarse::in_company;

/// Voxels that are sorted: index, mean from the lower corner (m), and side (m).
pub struct Voxels<'a> {
    /// Index of each.
    pub index: &'a [[i32; 3]],
    /// Mean of each voxel's points, m from its lower corner.
    pub mean: &'a [[f64; 3]],
    /// Side, m.
    pub voxel: f64,
}

/// Some of the voxels, about an origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Which voxels they are.
    pub kept: Vec<usize>,
    /// x, y of the origin, m.
    pub origin: [f64; 2],
    /// Ground cell of each, counted from the origin.
    pub cells: Vec<[i32; 2]>,
    /// Mean of each voxel's points, m from the origin.
    pub xy: Vec<[f64; 2]>,
    /// Mean height of each voxel's points over the floor, m.
    pub z: Vec<f64>,
}

impl Voxels<'_> {
    /// The voxels whose means lie between two heights over a floor (m), those left out that stand alone among voxels of
    /// `factor` times the size (see [`in_company`]).
    pub fn layer(&self, floor: f64, [low, high]: [f64; 2], factor: i32, least: u32) -> Layer {
        let height = |i: usize| f64::from(self.index[i][2]) * self.voxel + self.mean[i][2] - floor;
        let mut kept: Vec<usize> = (0..self.index.len()).filter(|&i| height(i) > low && height(i) < high).collect();
        let between: Vec<_> = kept.iter().map(|&i| self.index[i]).collect();
        let mut company = in_company(&between, factor, least).into_iter();
        kept.retain(|_| company.next() == Some(true));
        // The same origin for the same cloud, wherever it stands: a whole number of metres near its middle.
        let corner = [0, 1].map(|axis| {
            let middle = median(kept.iter().map(|&i| self.index[i][axis]).collect());
            ((middle * self.voxel).floor() / self.voxel).round_ties_even()
        });
        let cells: Vec<_> =
            kept.iter().map(|&i| [0, 1].map(|axis| self.index[i][axis] - corner[axis] as i32)).collect();
        let place = |(cell, &i): (&[i32; 2], &usize)| {
            [0, 1].map(|axis| f64::from(cell[axis]) * self.voxel + self.mean[i][axis])
        };
        Layer {
            origin: corner.map(|cell| cell * self.voxel),
            xy: cells.iter().zip(&kept).map(place).collect(),
            z: kept.iter().map(|&i| height(i)).collect(),
            cells,
            kept,
        }
    }
}

/// The middle of some values, or of the middle two; 0 of none.
fn median(mut values: Vec<i32>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let half = values.len() / 2;
    let is_odd = values.len() % 2 == 1;
    let (before, &mut upper, _) = values.select_nth_unstable(half);
    let lower = if is_odd { upper } else { before.iter().copied().max().unwrap_or(upper) };
    (f64::from(lower) + f64::from(upper)) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layer_counts_from_a_whole_metre_near_its_middle() {
        let index: Vec<_> = (0..40).flat_map(|x| (0..30).map(move |z| [100 + x, -60, z])).collect();
        let mean: Vec<_> = index.iter().map(|_| [0.01, 0.02, 0.03]).collect();
        let voxels = Voxels { index: &index, mean: &mean, voxel: 0.05 };
        let layer = voxels.layer(0.5, [-0.2, 0.4], 2, 8);
        assert_eq!(layer.origin, [5.0, -3.0]);
        assert_eq!(layer.kept.len(), 40 * 12); // heights 0.33, 0.38... 0.88
        let (first, last) = (0, layer.kept.len() - 1);
        assert_eq!((layer.cells[first], layer.cells[last]), ([0, 0], [39, 0]));
        assert!((layer.z[first] + 0.17).abs() < 1e-9 && (layer.z[last] - 0.38).abs() < 1e-9);
        assert!((layer.xy[last][0] - 1.96).abs() < 1e-9 && (layer.xy[last][1] - 0.02).abs() < 1e-9);
        assert_eq!(layer.kept[0], 6);
    }

    #[test]
    fn strays_are_left_out_and_nothing_makes_an_empty_layer() {
        let voxels = Voxels { index: &[[0, 0, 0], [900, 0, 0]], mean: &[[0.0; 3]; 2], voxel: 0.05 };
        let layer = voxels.layer(0.0, [-1.0, 1.0], 2, 8);
        assert_eq!(layer.origin, [0.0, 0.0]);
        assert!(layer.kept.is_empty() && layer.xy.is_empty());
        assert_eq!(voxels.layer(0.0, [-1.0, 1.0], 1, 1).kept, [0, 1]);
    }

    #[test]
    fn a_median_is_that_of_the_middle_two() {
        assert_eq!(median(vec![3, -1, 2]), 2.0);
        assert_eq!(median(vec![7, -1, 2, 3]), 2.5);
    }
}
