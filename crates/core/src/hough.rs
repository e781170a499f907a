//! The Hough transform over the cells of a ground-plane histogram (section 3.3 of the paper; Hough 1959, Duda and
//! Hart 1972): a line is the set of points with `x cos(theta) + y sin(theta) = rho`.
//!
//! Two ways to take lines from the accumulator: all its peaks at once ([`batch`], the paper's parallel approach), or
//! the strongest one, whose support is then taken out of the histogram and the accumulator before the next
//! ([`incremental`]). All lengths here are in cells, measured between the centres of cells.

use std::f64::consts::PI;

/// How lines are searched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Number of orientations over half a turn: 180 for steps of one degree.
    pub orientations: usize,
    /// Width of a bin of rho, cells; also the width of the strip that supports a line.
    pub rho_step: f64,
    /// Cells further apart than this along a line belong to different segments, cells.
    pub fill_gap: f64,
    /// Shorter segments are not returned, cells.
    pub min_length: f64,
    /// Stop when the strongest peak has fewer votes than this.
    pub min_votes: u32,
    /// Stop after this many lines.
    pub max_lines: usize,
}

/// A segment of a line, in cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// x1, y1, x2, y2.
    pub ends: [f64; 4],
    /// Cells that support it.
    pub votes: u32,
}

struct Accumulator {
    directions: Vec<(f64, f64)>,
    rho_step: f64,
    rho_bins: usize,
    rho_min: f64,
    votes: Vec<i32>,
}

impl Accumulator {
    fn new(cells: &[[i32; 2]], search: &Search) -> Self {
        let directions: Vec<_> = (0..search.orientations)
            .map(|i| {
                let (sine, cosine) = (PI * i as f64 / search.orientations as f64).sin_cos();
                (cosine, sine)
            })
            .collect();
        let reach = cells.iter().map(|c| f64::from(c[0]).hypot(f64::from(c[1]))).fold(0.0, f64::max) + 1.0;
        let rho_bins = (2.0 * reach / search.rho_step).ceil() as usize + 1;
        let votes = vec![0; directions.len() * rho_bins];
        let mut accumulator = Self { directions, rho_step: search.rho_step, rho_bins, rho_min: -reach, votes };
        cells.iter().for_each(|&cell| accumulator.vote(cell, 1));
        accumulator
    }

    fn rho_bin(&self, cell: [i32; 2], (cosine, sine): (f64, f64)) -> usize {
        let rho = f64::from(cell[0]) * cosine + f64::from(cell[1]) * sine;
        ((rho - self.rho_min) / self.rho_step + 0.5) as usize
    }

    fn vote(&mut self, cell: [i32; 2], weight: i32) {
        for orientation in 0..self.directions.len() {
            let bin = self.rho_bin(cell, self.directions[orientation]);
            self.votes[orientation * self.rho_bins + bin] += weight;
        }
    }

    /// The bin with most votes, the first of several.
    fn strongest(&self) -> Option<(usize, i32)> {
        let most = self.votes.iter().copied().max()?;
        Some((self.votes.iter().position(|&votes| votes == most)?, most))
    }

    /// Whether no bin next to this one, in orientation or rho, has more votes. Orientations wrap around: half a turn
    /// further the same line has the opposite rho.
    fn is_peak(&self, bin: usize) -> bool {
        let (orientation, rho) = ((bin / self.rho_bins) as isize, (bin % self.rho_bins) as isize);
        let bins = self.rho_bins as isize;
        (-1..=1).all(|step| {
            let turned = orientation + step;
            let wrapped = turned.rem_euclid(self.directions.len() as isize);
            let centre = if wrapped == turned { rho } else { bins - 1 - rho };
            (-1..=1).all(|shift| {
                let neighbour = centre + shift;
                if !(0..bins).contains(&neighbour) || (step == 0 && shift == 0) {
                    return true;
                }
                let other = (wrapped * bins + neighbour) as usize;
                // Of equal neighbours the first is the peak.
                self.votes[other] < self.votes[bin] || (self.votes[other] == self.votes[bin] && bin < other)
            })
        })
    }

    /// The cells in the strip of a bin, as (distance along the line, index of the cell), in order along the line.
    fn support(&self, bin: usize, cells: &[[i32; 2]], alive: &[bool]) -> Vec<(f64, usize)> {
        let direction = self.directions[bin / self.rho_bins];
        let mut support: Vec<_> = (0..cells.len())
            .filter(|&i| alive[i] && self.rho_bin(cells[i], direction) == bin % self.rho_bins)
            .map(|i| (f64::from(cells[i][1]) * direction.0 - f64::from(cells[i][0]) * direction.1, i))
            .collect();
        support.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        support
    }

    fn segment(&self, bin: usize, run: &[(f64, usize)]) -> Segment {
        let (cosine, sine) = self.directions[bin / self.rho_bins];
        let rho = self.rho_min + self.rho_step * (bin % self.rho_bins) as f64;
        let at = |t: f64| [rho * cosine - t * sine, rho * sine + t * cosine];
        let ([x1, y1], [x2, y2]) = (at(run[0].0), at(run[run.len() - 1].0));
        Segment { ends: [x1, y1, x2, y2], votes: run.len() as u32 }
    }
}

fn runs(support: &[(f64, usize)], fill_gap: f64) -> impl Iterator<Item = &[(f64, usize)]> {
    support.chunk_by(move |a, b| b.0 - a.0 <= fill_gap)
}

fn length(run: &[(f64, usize)]) -> f64 {
    run[run.len() - 1].0 - run[0].0
}

/// Lines one by one, strongest first: the longest run of the strongest peak becomes a segment, and its cells leave
/// histogram and accumulator. A peak without a run of `min_length` is passed over.
pub fn incremental(cells: &[[i32; 2]], search: &Search) -> Vec<Segment> {
    let mut accumulator = Accumulator::new(cells, search);
    let mut alive = vec![true; cells.len()];
    let mut segments = Vec::new();
    while segments.len() < search.max_lines {
        let Some((bin, votes)) = accumulator.strongest() else { break };
        if votes < search.min_votes.max(1) as i32 {
            break;
        }
        let support = accumulator.support(bin, cells, &alive);
        let longest = runs(&support, search.fill_gap).reduce(|a, b| if length(b) > length(a) { b } else { a });
        match longest {
            Some(run) if length(run) >= search.min_length && run.len() >= search.min_votes as usize => {
                segments.push(accumulator.segment(bin, run));
                for &(_, i) in run {
                    alive[i] = false;
                    accumulator.vote(cells[i], -1);
                }
            }
            // Far below zero, so that votes taken away later cannot wrap and none given back can revive it.
            _ => accumulator.votes[bin] = i32::MIN / 2,
        }
    }
    segments
}

/// Lines all at once: the local peaks of the accumulator, strongest first, each cut into its runs. The same cells may
/// support several of them.
pub fn batch(cells: &[[i32; 2]], search: &Search) -> Vec<Segment> {
    let accumulator = Accumulator::new(cells, search);
    let alive = vec![true; cells.len()];
    let mut peaks: Vec<usize> = (0..accumulator.votes.len())
        .filter(|&bin| accumulator.votes[bin] >= search.min_votes.max(1) as i32 && accumulator.is_peak(bin))
        .collect();
    peaks.sort_by_key(|&bin| (-accumulator.votes[bin], bin));
    let mut segments = Vec::new();
    for bin in peaks {
        for run in runs(&accumulator.support(bin, cells, &alive), search.fill_gap) {
            if segments.len() < search.max_lines && length(run) >= search.min_length && run.len() > 1 {
                segments.push(accumulator.segment(bin, run));
            }
        }
    }
    segments
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEARCH: Search =
        Search { orientations: 180, rho_step: 1.0, fill_gap: 7.0, min_length: 2.0, min_votes: 4, max_lines: 1000 };

    fn row(y: i32, xs: std::ops::Range<i32>) -> Vec<[i32; 2]> {
        xs.map(|x| [x, y]).collect()
    }

    #[test]
    fn a_row_of_cells_is_one_segment() {
        for find in [incremental, batch] {
            let found = find(&row(3, 10..50), &SEARCH);
            // A cell: the strip of rho is one cell wide, and within it orientations of equal votes differ by a degree.
            for (end, expected) in found[0].ends.iter().zip([49.0, 3.0, 10.0, 3.0]) {
                assert!((end - expected).abs() < 1.0, "{:?}", found[0]);
            }
            assert_eq!(found[0].votes, 40);
        }
    }

    #[test]
    fn the_incremental_search_uses_each_cell_once() {
        let mut cells = row(0, 0..40);
        cells.extend((1..40).map(|y| [0, y]));
        let found = incremental(&cells, &SEARCH);
        assert_eq!(found.len(), 2);
        assert_eq!(found.iter().map(|s| s.votes).sum::<u32>(), 79);
    }

    #[test]
    fn a_gap_wider_than_the_fill_gap_parts_two_segments() {
        let mut cells = row(0, 0..20);
        cells.extend(row(0, 27..40));
        assert_eq!(incremental(&cells, &Search { fill_gap: 8.0, ..SEARCH }).len(), 1);
        assert_eq!(incremental(&cells, &Search { fill_gap: 7.5, ..SEARCH }).len(), 2);
    }

    #[test]
    fn both_stops_end_the_search() {
        let mut cells = row(0, 0..40);
        cells.extend(row(20, 0..30));
        assert_eq!(incremental(&cells, &Search { max_lines: 1, ..SEARCH }).len(), 1);
        assert_eq!(incremental(&cells, &Search { min_votes: 35, ..SEARCH }).len(), 1);
        assert!(incremental(&[], &SEARCH).is_empty() && batch(&[], &SEARCH).is_empty());
    }
}
