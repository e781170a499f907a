//! Points near lines, counted by the steps into which the lines are cut.
//!
//! An elevation asks again and again how many points each step of a line has before or behind it, between two depths
//! and two heights. The points near the lines are gathered once and stay here; what is asked for is counted in one pass
//! over them.

use crate::places::Places;

/// Hits of a step are kept in so many parts of the strip's width, so that those of other depths are passed over.
const PARTS: usize = 16;

/// What counts at a step: points to one side of the line, in a range of depths to that side, and of heights about some
/// height; ends do not count.
#[derive(Debug, Clone, Copy)]
pub struct Range {
    /// 1 for the left of the line, -1 for the right.
    pub side: f64,
    /// From and to this far to that side, m; what lies to the other is less than 0.
    pub depth: [f64; 2],
    /// The height about which heights are counted, m.
    pub about: f64,
    /// From and to this far above it, m.
    pub height: [f64; 2],
}

impl Range {
    /// Whether a point, its offset to the left and its height, is in it; told without a branch.
    fn holds(&self, [offset, height]: [f64; 2]) -> bool {
        let (depth, above) = (self.side * offset, height - self.about);
        (depth > self.depth[0]) & (depth < self.depth[1]) & (above > self.height[0]) & (above < self.height[1])
    }
}

/// Points near lines.
pub struct Hits {
    half_width: f64,
    /// Offset to the left of its line, and height, of each point, m; step after step, and part after part.
    hits: Vec<[f64; 2]>,
    /// Where those of each part begin, and past the last.
    starts: Vec<u32>,
}

impl Hits {
    /// The points within `half_width` (m) of lines, and at most `margin` (m) beyond their ends; `heights` are those of
    /// all points, m. Steps of `step` metres begin at the margin before each line's start; line i has those from
    /// `first[i]` to before `first[i + 1]`.
    pub fn new(
        places: &Places,
        heights: &[f64],
        lines: &[[f64; 4]],
        [half_width, margin]: [f64; 2],
        step: f64,
        first: &[usize],
    ) -> Self {
        let mut this = Self { half_width, hits: Vec::new(), starts: vec![0] };
        let (mut found, mut parts, mut ends) = (Vec::new(), Vec::<u32>::new(), Vec::new());
        for (&line, range) in lines.iter().zip(first.windows(2)) {
            let steps = range[1].saturating_sub(range[0]);
            found.clear();
            parts.clear();
            ends.clear();
            ends.resize(steps * PARTS + 1, 0);
            places.in_strip(line, half_width, margin, |point, along, offset| {
                let at = (((along + margin) / step) as usize).min(steps.saturating_sub(1));
                let part = at * PARTS + this.part(offset);
                ends[part + 1] += 1;
                parts.push(part as u32);
                found.push([offset, heights[point]]);
            });
            let before = this.hits.len();
            for part in 1..ends.len() {
                ends[part] += ends[part - 1];
                this.starts.push((before + ends[part]) as u32);
            }
            this.hits.resize(before + found.len(), [0.0; 2]);
            let sorted = &mut this.hits[before..];
            for (&part, &hit) in parts.iter().zip(&found) {
                let end = &mut ends[part as usize];
                sorted[*end] = hit;
                *end += 1;
            }
        }
        this
    }

    /// The part of the width in which an offset lies: a greater one never in an earlier part.
    fn part(&self, offset: f64) -> usize {
        let share = (offset + self.half_width) / (2.0 * self.half_width);
        ((share * PARTS as f64) as usize).min(PARTS - 1)
    }

    /// The height of the highest point, m; minus infinity without any.
    pub fn highest(&self) -> f64 {
        self.hits.iter().map(|hit| hit[1]).fold(f64::NEG_INFINITY, f64::max)
    }

    /// How many points each of so many steps has in each of some ranges, which are told for a range's number and a step:
    /// range after range. All are counted at a step while its points are at hand.
    pub fn counts(&self, steps: usize, ranges: usize, range: impl Fn(usize, usize) -> Range) -> Vec<Vec<u32>> {
        let mut counts = vec![Vec::with_capacity(steps); ranges];
        for step in 0..steps {
            for (number, counts) in counts.iter_mut().enumerate() {
                let range = range(number, step);
                let near = self.near(step, &range).iter();
                counts.push(near.filter(|&&hit| range.holds(hit)).count() as u32);
            }
        }
        counts
    }

    /// How many points each step has in its range, in each of `cells` depths of `cell` metres: step after step.
    pub fn by_depth(&self, ranges: &[Range], cell: f64, cells: usize) -> Vec<u32> {
        self.spread(ranges, cells, |depth, _| (depth / cell) as usize)
    }

    /// The same by height.
    pub fn by_height(&self, ranges: &[Range], cell: f64, cells: usize) -> Vec<u32> {
        self.spread(ranges, cells, |_, height| (height / cell) as usize)
    }

    /// Counts in `cells` cells a step; points in cells beyond the last are left out.
    fn spread(&self, ranges: &[Range], cells: usize, cell: impl Fn(f64, f64) -> usize) -> Vec<u32> {
        let mut counts = vec![0; ranges.len() * cells];
        for (step, range) in ranges.iter().enumerate() {
            for &[offset, height] in self.near(step, range).iter().filter(|&&hit| range.holds(hit)) {
                let cell = cell(range.side * offset, height);
                if cell < cells {
                    counts[step * cells + cell] += 1;
                }
            }
        }
        counts
    }

    /// The points at a step among which those in a range are.
    fn near(&self, step: usize, range: &Range) -> &[[f64; 2]] {
        let parts = &self.starts[step * PARTS..=(step + 1) * PARTS];
        let ends = range.depth.map(|depth| self.part(range.side * depth));
        &self.hits[parts[ends[0].min(ends[1])] as usize..parts[ends[0].max(ends[1]) + 1] as usize]
    }
}

/// Means over the `width` rows of `values` about each, never across lines; line i has the rows from `first[i]` to before
/// `first[i + 1]`. A row is `columns` values.
pub fn means_along(values: &[f64], columns: usize, first: &[usize], width: usize) -> Vec<f64> {
    let mut means = vec![0.0; values.len()];
    // Running sums of all rows before, as one who adds up all of them has them: lines share what is lost in rounding.
    let mut before = vec![0.0; columns];
    let mut sums = Vec::new();
    for range in first.windows(2) {
        let count = range[1].saturating_sub(range[0]);
        sums.clear();
        sums.extend_from_slice(&before);
        for row in values[range[0] * columns..].chunks_exact(columns.max(1)).take(count) {
            for (sum, value) in before.iter_mut().zip(row) {
                *sum += value;
            }
            sums.extend_from_slice(&before);
        }
        for row in 0..count {
            let (low, high) = (row.saturating_sub(width / 2), (row + width / 2 + 1).min(count));
            for column in 0..columns {
                let sum = sums[high * columns + column] - sums[low * columns + column];
                means[(range[0] + row) * columns + column] = sum / (high - low) as f64;
            }
        }
    }
    means
}

/// Values, 0 or more, with gaps of fewer than `width` (odd) steps filled to the level of their shores, never across
/// lines: the least, over as many steps, of the greatest. Line i has the steps from `first[i]` to before `first[i + 1]`.
pub fn close_gaps(values: &[f64], first: &[usize], width: usize) -> Vec<f64> {
    let reach = width / 2;
    let mut closed = Vec::with_capacity(values.len());
    let (mut line, mut greatest) = (Vec::new(), Vec::new());
    for range in first.windows(2) {
        line.clear();
        line.resize(2 * reach, 0.0);
        line.extend_from_slice(&values[range[0]..range[1]]);
        line.resize(line.len() + 2 * reach, 0.0);
        greatest.clear();
        greatest.extend(line.windows(2 * reach + 1).map(|about| about.iter().copied().fold(0.0, f64::max)));
        let least = |about: &[f64]| about.iter().copied().fold(f64::INFINITY, f64::min);
        closed.extend(greatest.windows(2 * reach + 1).map(least));
    }
    closed
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Along x from 0 to 1: two points on the left at either end, one on the right; and one out of reach.
    fn hits() -> Hits {
        let points = vec![[0.05, 0.2], [0.5, -0.1], [1.2, 0.1], [3.0, 0.1]];
        let places = Places::new(points, &[[0, 0], [0, -1], [1, 0], [3, 0]], 1.0);
        assert!(places.is_err()); // out of order
        let points = vec![[0.5, -0.1], [0.05, 0.2], [1.2, 0.1], [3.0, 0.1]];
        let places = Places::new(points, &[[0, -1], [0, 0], [1, 0], [3, 0]], 1.0).unwrap();
        let lines = [[9.0, 9.0, 9.5, 9.0], [0.0, 0.0, 1.0, 0.0]];
        Hits::new(&places, &[2.4, 0.5, 2.5, 2.5], &lines, [0.3, 0.5], 0.5, &[0, 3, 7])
    }

    fn count(hits: &Hits, ranges: &[Range]) -> Vec<u32> {
        let mut counts = hits.counts(ranges.len(), 2, |number, step| Range {
            side: if number == 0 { ranges[step].side } else { -ranges[step].side },
            ..ranges[step]
        });
        let other = ranges.iter().map(|range| Range { side: -range.side, ..*range });
        assert_eq!(counts.pop(), hits.counts(ranges.len(), 1, |_, step| other.clone().nth(step).unwrap()).pop());
        counts.remove(0)
    }

    fn ranges(side: f64) -> Vec<Range> {
        vec![Range { side, depth: [0.0, 0.15], about: 2.5, height: [-0.2, 0.2] }; 7]
    }

    #[test]
    fn points_are_counted_at_their_steps_within_the_ranges() {
        let hits = hits();
        assert_eq!(count(&hits, &ranges(1.0)), [0, 0, 0, 0, 0, 0, 1]);
        assert_eq!(count(&hits, &ranges(-1.0)), [0, 0, 0, 0, 0, 1, 0]);
        assert!(hits.highest() == 2.5);
        let all = vec![Range { side: 1.0, depth: [-1.0, 1.0], about: 0.0, height: [0.0, 3.0] }; 7];
        assert_eq!(count(&hits, &all), [0, 0, 0, 0, 1, 1, 1]);
        // An end of a range does not count.
        let open = vec![Range { side: 1.0, depth: [-1.0, 1.0], about: 0.0, height: [0.5, 2.5] }; 7];
        assert_eq!(count(&hits, &open), [0, 0, 0, 0, 0, 1, 0]);
    }

    #[test]
    fn counts_by_depth_and_height_add_up() {
        let hits = hits();
        let left = vec![Range { side: 1.0, depth: [0.0, 1.0], about: 0.0, height: [0.0, 3.0] }; 7];
        let by_depth = hits.by_depth(&left, 0.15, 2);
        assert_eq!(by_depth[8..], [0, 1, 0, 0, 1, 0]);
        let by_height = hits.by_height(&left, 1.0, 3);
        assert_eq!(by_height[12..15], [1, 0, 0]);
        assert_eq!(by_height[18..], [0, 0, 1]);
        assert_eq!(hits.by_height(&left, 1.0, 1).iter().sum::<u32>(), 1);
    }

    #[test]
    fn means_stay_within_their_lines() {
        let values = [1.0, 10.0, 2.0, 20.0, 3.0, 30.0, 5.0, 50.0];
        let means = means_along(&values, 2, &[0, 3, 3, 4], 3);
        assert_eq!(means, [1.5, 15.0, 2.0, 20.0, 2.5, 25.0, 5.0, 50.0]);
        assert!(means_along(&[], 1, &[0], 5).is_empty());
    }

    #[test]
    fn gaps_are_filled_to_the_level_of_their_shores() {
        let values = [0.0, 1.0, 0.0, 0.5, 0.0, 0.0, 0.7, 0.9, 0.0, 0.9];
        let closed = close_gaps(&values, &[0, 4, 4, 10], 3);
        assert_eq!(closed, [0.0, 1.0, 0.5, 0.5, 0.0, 0.0, 0.7, 0.9, 0.9, 0.9]);
        assert_eq!(close_gaps(&values, &[0, 10], 1), values);
        assert!(close_gaps(&[], &[0], 5).is_empty());
    }

    #[test]
    fn without_points_nothing_is_counted() {
        let places = Places::new(Vec::new(), &[], 0.05).unwrap();
        let hits = Hits::new(&places, &[], &[[0.0, 0.0, 1.0, 0.0]], [0.3, 0.0], 0.5, &[0, 2]);
        assert_eq!(count(&hits, &ranges(1.0)[..2]), [0, 0]);
        assert!(hits.highest() < 0.0);
    }
}
