//! Grids of heights over the ground, looked up beside walls.

/// Heights (m) of square cells of `cell` metres, row after row; `low` is the index of the first cell. What lies beyond
/// the grid has the height of its border.
pub struct Heights<'a> {
    /// Of all cells.
    pub heights: &'a [f64],
    /// Number of rows and of cells in each.
    pub shape: [usize; 2],
    /// Index of the first cell.
    pub low: [i64; 2],
    /// Side of a cell, m.
    pub cell: f64,
}

impl Heights<'_> {
    /// The height at a place (m).
    fn at(&self, place: [f64; 2]) -> f64 {
        let [x, y] = [0, 1].map(|axis| {
            let index = floor(place[axis] / self.cell) - self.low[axis];
            index.clamp(0, self.shape[axis] as i64 - 1) as usize
        });
        self.heights[x * self.shape[1] + y]
    }

    /// The height (m) about each place (m): of those after some steps (to a side, along; m), in the directions to the
    /// place's side and along, that are finite, the one at a `share` from the least to the greatest. Not a number where
    /// fewer than `least` are; and 0 where a quarter of them or more lie nearer than `level` to 0.
    pub fn about(
        &self,
        steps: &[[f64; 2]],
        [places, aside, along]: [&[[f64; 2]]; 3],
        share: f64,
        least: usize,
        level: f64,
    ) -> Vec<f64> {
        let mut known = Vec::with_capacity(steps.len());
        let ways = places.iter().zip(aside).zip(along);
        let height = |((place, aside), along): ((&[f64; 2], &[f64; 2]), &[f64; 2])| {
            known.clear();
            known.extend(steps.iter().map(|[to_side, onward]| {
                self.at([0, 1].map(|axis| place[axis] + to_side * aside[axis] + onward * along[axis]))
            }));
            known.retain(|height| height.is_finite());
            if known.len() < least.max(1) {
                return f64::NAN;
            }
            let near = known.iter().filter(|height| height.abs() < level).count();
            if level > 0.0 && 4 * near >= known.len() {
                return 0.0;
            }
            let rank = (share * (known.len() - 1) as f64).round_ties_even() as usize;
            *known.select_nth_unstable_by(rank, f64::total_cmp).1
        };
        ways.map(height).collect()
    }
}

/// Without a call of the C library, which rounding down is on old processors.
fn floor(value: f64) -> i64 {
    let whole = value as i64;
    whole - i64::from(whole as f64 > value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_are_those_of_the_cells_that_steps_lead_to() {
        let heights: Vec<f64> = (0..6).map(f64::from).collect();
        let grid = Heights { heights: &heights, shape: [2, 3], low: [-1, 0], cell: 0.5 };
        let ways: [&[[f64; 2]]; 3] =
            [&[[-0.3, 0.2], [0.1, 1.2]], &[[1.0, 0.0], [0.0, -1.0]], &[[0.0, 1.0], [1.0, 0.0]]];
        for (step, expected) in [([0.0, 0.0], [0.0, 5.0]), ([0.5, 0.0], [3.0, 4.0]), ([-9.0, 9.0], [2.0, 5.0])] {
            assert_eq!(grid.about(&[step], ways, 0.7, 1, 0.0), expected);
        }
        let steps = [[0.0, 0.0], [0.5, 0.0], [-9.0, 9.0], [0.0, 1.0]]; // to 0, 3, 2, 2 from the first place
        assert_eq!(grid.about(&steps, ways, 0.0, 4, 0.0)[0], 0.0);
        assert_eq!(grid.about(&steps, ways, 0.7, 4, 0.0)[0], 2.0);
        assert_eq!(grid.about(&steps, ways, 1.0, 4, 0.0)[0], 3.0);
        assert_eq!(grid.about(&steps, ways, 1.0, 4, 0.1)[0], 0.0);
        assert!(grid.about(&steps, ways, 1.0, 5, 0.0)[0].is_nan());
    }

    #[test]
    fn what_is_not_finite_is_not_known() {
        let grid = Heights { heights: &[f64::INFINITY, 2.0, 1.0], shape: [1, 3], low: [0, 0], cell: 1.0 };
        let (places, up): (&[[f64; 2]], &[[f64; 2]]) = (&[[0.5, 0.5]], &[[0.0, 1.0]]);
        let steps = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]];
        assert_eq!(grid.about(&steps, [places, up, up], 1.0, 2, 0.0), [2.0]);
        assert!(grid.about(&steps, [places, up, up], 1.0, 3, 0.0)[0].is_nan());
        assert!(grid.about(&steps[..1], [places, up, up], 1.0, 0, 0.0)[0].is_nan());
    }
}
