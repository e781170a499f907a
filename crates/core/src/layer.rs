//! The voxels between two heights, about an origin near their middle.

use crate::coarse::in_company;

/// Voxels that are sorted: index, mean from the lower corner (m), height of that mean (m), and side (m).
pub struct Voxels<'a> {
    /// Index of each.
    pub index: &'a [[i32; 3]],
    /// Mean of each voxel's points, m from its lower corner.
    pub mean: &'a [[f64; 3]],
    /// Mean height of each voxel's points, m.
    pub height: &'a [f64],
    /// Side, m.
    pub voxel: f64,
}

/// Some of the voxels, about an origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Which voxels they are.
    pub kept: Vec<usize>,
    /// Cell at whose lower corner the origin lies.
    pub corner: [f64; 2],
}

impl Voxels<'_> {
    /// The voxels whose means lie between two heights over a floor (m), those left out that stand alone among voxels of
    /// `factor` times the size (see [`in_company`]).
    pub fn layer(&self, floor: f64, [low, high]: [f64; 2], factor: i32, least: u32) -> Layer {
        let is_between = |&i: &usize| self.height[i] - floor > low && self.height[i] - floor < high;
        let mut kept: Vec<usize> = (0..self.index.len()).filter(is_between).collect();
        let between: Vec<_> = kept.iter().map(|&i| self.index[i]).collect();
        let mut company = in_company(&between, factor, least).into_iter();
        kept.retain(|_| company.next() == Some(true));
        // The same origin for the same cloud, wherever it stands: a whole number of metres near its middle.
        let corner = [0, 1].map(|axis| {
            let middle = median(kept.iter().map(|&i| self.index[i][axis]).collect());
            ((middle * self.voxel).floor() / self.voxel).round_ties_even()
        });
        Layer { kept, corner }
    }

    /// Of each voxel of a layer: its ground cell, and the mean of its points (m), both counted from the origin.
    pub fn places<'a>(&'a self, layer: &'a Layer) -> impl Iterator<Item = ([i32; 2], [f64; 2])> + 'a {
        layer.kept.iter().map(|&i| {
            let cell = [0, 1].map(|axis| self.index[i][axis] - layer.corner[axis] as i32);
            (cell, [0, 1].map(|axis| f64::from(cell[axis]) * self.voxel + self.mean[i][axis]))
        })
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
        let height: Vec<_> = index.iter().map(|&[_, _, z]| f64::from(z) * 0.05 + 0.03).collect();
        let voxels = Voxels { index: &index, mean: &mean, height: &height, voxel: 0.05 };
        let layer = voxels.layer(0.5, [-0.2, 0.4], 2, 8);
        assert_eq!(layer.corner, [100.0, -60.0]);
        assert_eq!(layer.kept.len(), 40 * 12); // heights 0.33, 0.38... 0.88
        assert_eq!(layer.kept[..13], [6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 36]);
        let places: Vec<_> = voxels.places(&layer).collect();
        assert_eq!((places[0].0, places[479].0), ([0, 0], [39, 0]));
        let [x, y] = places[479].1;
        assert!((x - 1.96).abs() < 1e-9 && (y - 0.02).abs() < 1e-9);
    }

    #[test]
    fn strays_are_left_out_and_nothing_makes_an_empty_layer() {
        let index = [[0, 0, 0], [900, 0, 0]];
        let voxels = Voxels { index: &index, mean: &[[0.0; 3]; 2], height: &[0.0; 2], voxel: 0.05 };
        assert_eq!(voxels.layer(0.0, [-1.0, 1.0], 2, 8), Layer { kept: Vec::new(), corner: [0.0, 0.0] });
        assert_eq!(voxels.layer(0.0, [-1.0, 1.0], 1, 1).kept, [0, 1]);
    }

    #[test]
    fn a_median_is_that_of_the_middle_two() {
        assert_eq!(median(vec![3, -1, 2]), 2.0);
        assert_eq!(median(vec![7, -1, 2, 3]), 2.5);
    }
}
