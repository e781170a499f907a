//! Grids of heights over the ground, looked up beside walls; and means along walls.

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

    /// The heights about places (m), for each of some steps (to a side, along; m) and each place with the directions to
    /// its side and along: step after step.
    pub fn about(&self, steps: &[[f64; 2]], places: &[[f64; 2]], aside: &[[f64; 2]], along: &[[f64; 2]]) -> Vec<f64> {
        let mut found = Vec::with_capacity(steps.len() * places.len());
        for [to_side, onward] in steps {
            found.extend(places.iter().zip(aside).zip(along).map(|((place, aside), along)| {
                self.at([0, 1].map(|axis| place[axis] + to_side * aside[axis] + onward * along[axis]))
            }));
        }
        found
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
        let found = grid.about(
            &[[0.0, 0.0], [0.5, 0.0], [0.0, 1.0], [-9.0, 9.0]],
            &[[-0.3, 0.2], [0.1, 1.2]],
            &[[1.0, 0.0], [0.0, -1.0]],
            &[[0.0, 1.0], [1.0, 0.0]],
        );
        assert_eq!(found, [0.0, 5.0, 3.0, 4.0, 2.0, 5.0, 2.0, 5.0]);
    }
}
