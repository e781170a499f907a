//! Grids of heights over the ground, looked up beside walls.

/// Places that are looked at together: their samples are put in order side by side.
const TOGETHER: usize = 8;

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

/// Added to a number and taken away again, it leaves a whole number.
const WHOLE: f64 = (3_u64 << 51) as f64;

impl Heights<'_> {
    /// The heights at places (x and y of each, m): told side by side, without a branch, in floating point alone.
    fn at(&self, places: &[[f64; TOGETHER]; 2]) -> [f64; TOGETHER] {
        let [x, y] = [0, 1].map(|axis| {
            let (low, last) = (self.low[axis] as f64, (self.shape[axis] - 1) as f64);
            self.indices(&places[axis]).map(|index| (index - low).max(0.0).min(last))
        });
        let row = self.shape[1] as f64;
        std::array::from_fn(|i| self.heights[(x[i] * row + y[i]) as usize])
    }

    /// The indices of the cells that places (m) along an axis are in, whole numbers.
    fn indices(&self, places: &[f64; TOGETHER]) -> [f64; TOGETHER] {
        let per_cell = self.cell.recip();
        let mut is_sure = true;
        let indices = places.map(|place| {
            let guess = place * per_cell;
            let nearest = (guess + WHOLE) - WHOLE;
            let index = if nearest > guess { nearest - 1.0 } else { nearest };
            is_sure &= (guess - index - 0.5).abs() < 0.499_999;
            index
        });
        // Dividing takes longer, and tells more only at the ends of a cell.
        if is_sure { indices } else { places.map(|place| (place / self.cell).floor()) }
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
        let order = exchanges(steps.len());
        let mut samples = vec![[f64::INFINITY; TOGETHER]; steps.len()];
        let mut found = Vec::with_capacity(places.len());
        for first in (0..places.len()).step_by(TOGETHER) {
            let count = TOGETHER.min(places.len() - first);
            // The last ones have one more than once.
            let [place, aside, along] =
                [places, aside, along].map(|of| [0, 1].map(|axis| lanes(|i| of[first + i.min(count - 1)][axis])));
            let (mut known, mut near) = ([0_usize; TOGETHER], [0_usize; TOGETHER]);
            for (sample, [to_side, onward]) in samples.iter_mut().zip(steps) {
                let places =
                    [0, 1].map(|axis| lanes(|i| place[axis][i] + to_side * aside[axis][i] + onward * along[axis][i]));
                *sample = self.at(&places);
                for i in 0..TOGETHER {
                    known[i] += usize::from(sample[i].is_finite());
                    near[i] += usize::from(sample[i].abs() < level);
                    sample[i] = if sample[i].is_finite() { sample[i] } else { f64::INFINITY };
                }
            }
            let is_known = |i: usize| known[i] >= least.max(1);
            let is_level = |i: usize| level > 0.0 && 4 * near[i] >= known[i];
            if (0..count).any(|i| is_known(i) && !is_level(i)) {
                for &[one, other] in &order {
                    let (low, high) = (samples[one], samples[other]);
                    for i in 0..TOGETHER {
                        samples[one][i] = if low[i] < high[i] { low[i] } else { high[i] };
                        samples[other][i] = if low[i] < high[i] { high[i] } else { low[i] };
                    }
                }
            }
            found.extend((0..count).map(|i| match (is_known(i), is_level(i)) {
                (false, _) => f64::NAN,
                (true, true) => 0.0,
                (true, false) => samples[(share * (known[i] - 1) as f64).round_ties_even() as usize][i],
            }));
        }
        found
    }
}

/// Pairs of places whose values, exchanged where the first is greater, one pair after the other, come in order: Batcher's
/// network (Knuth, The Art of Computer Programming 3, 5.2.2, algorithm M). It takes no branch.
fn exchanges(count: usize) -> Vec<[usize; 2]> {
    let mut pairs = Vec::new();
    let powers = |first: usize, last: usize| (0..usize::BITS).map(move |i| first << i).take_while(move |&p| p <= last);
    for whole in powers(1, count.saturating_sub(1)) {
        for apart in powers(1, whole).collect::<Vec<_>>().into_iter().rev() {
            for start in (apart % whole..count.saturating_sub(apart)).step_by(2 * apart) {
                let within = start..(start + apart).min(count - apart);
                let same = |&place: &usize| place / (2 * whole) == (place + apart) / (2 * whole);
                pairs.extend(within.filter(same).map(|place| [place, place + apart]));
            }
        }
    }
    pairs
}

fn lanes(of: impl Fn(usize) -> f64) -> [f64; TOGETHER] {
    std::array::from_fn(of)
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
    fn exchanges_put_all_values_in_order() {
        for count in 0..12 {
            let order = exchanges(count);
            // Zeros and ones are enough (Knuth 3, 5.3.4, theorem Z).
            for ones in 0..1_u32 << count {
                let mut values: Vec<bool> = (0..count).map(|i| ones >> i & 1 == 1).collect();
                for &[one, other] in &order {
                    assert!(one < other);
                    if values[one] & !values[other] {
                        values.swap(one, other);
                    }
                }
                assert!(values.is_sorted());
            }
        }
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
