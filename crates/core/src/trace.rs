//! Straight lines traced through weighted points of the ground plane (not in the paper).
//!
//! Where the paper's Hough transform lets all cells of a storey vote at once, here each point asks its neighbourhood:
//! the orientation with most weight in a narrow band through the point is the strongest line there. The strongest
//! places are traced first: the line is fitted by weighted least squares, followed both ways to the first wide gap,
//! fitted again, and its points are taken away. Work grows with the number of points, not with the building's extent
//! times its lines, and a band of a few centimetres keeps the two faces of a thin wall apart.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::places::Places;

/// How lines are traced.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trace {
    /// Half the width of the band whose points belong to a line, m.
    pub band: f64,
    /// How far a point asks its neighbourhood, m.
    pub reach: f64,
    /// A line ends where no point follows for this long, m.
    pub gap: f64,
    /// Lines with less weight are not returned.
    pub min_weight: f64,
    /// Shorter lines are not returned, m.
    pub min_length: f64,
}

/// A traced line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// x1, y1, x2, y2, m.
    pub ends: [f64; 4],
    /// Weight of its points.
    pub weight: f64,
}

const ORIENTATIONS: usize = 60;
const MAX_ROUNDS: usize = 30;

/// Weighted least squares of a line through (x, y): centre and direction.
#[derive(Default)]
struct Sums {
    w: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Sums {
    fn add(&mut self, [x, y]: [f64; 2], w: f64) {
        self.w += w;
        self.x += w * x;
        self.y += w * y;
        self.xx += w * x * x;
        self.xy += w * x * y;
        self.yy += w * y * y;
    }

    fn line(&self) -> Option<([f64; 2], [f64; 2])> {
        if self.w <= 0.0 {
            return None;
        }
        let (x, y) = (self.x / self.w, self.y / self.w);
        let (xx, xy, yy) = (self.xx / self.w - x * x, self.xy / self.w - x * y, self.yy / self.w - y * y);
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        Some(([x, y], [angle.cos(), angle.sin()]))
    }
}

/// Trace lines through points of the given weights, strongest place first. Each point belongs to one line at most.
pub fn trace(places: &Places, weights: &[f64], search: &Trace) -> Vec<Line> {
    let points = places.points();
    let directions: Vec<[f64; 2]> = (0..ORIENTATIONS)
        .map(|i| {
            let (sine, cosine) = (PI * i as f64 / ORIENTATIONS as f64).sin_cos();
            [cosine, sine]
        })
        .collect();
    let mut free = vec![true; points.len()];
    let strengths: Vec<f64> =
        (0..points.len()).into_par_iter().map(|i| strongest(i, places, weights, &directions, search, None).0).collect();
    let mut seeds: Vec<usize> = (0..points.len()).filter(|&i| strengths[i] >= search.min_weight).collect();
    seeds.sort_by(|&a, &b| strengths[b].total_cmp(&strengths[a]).then(a.cmp(&b)));
    let mut lines = Vec::new();
    for seed in seeds {
        if !free[seed] {
            continue;
        }
        let (strength, direction) = strongest(seed, places, weights, &directions, search, Some(&free));
        if strength < search.min_weight {
            continue;
        }
        if let Some((line, members)) = follow(seed, direction, places, weights, &free, search) {
            members.iter().for_each(|&i| free[i] = false);
            if line.weight >= search.min_weight && length(line.ends) >= search.min_length {
                lines.push(line);
            }
        } else {
            free[seed] = false;
        }
    }
    lines
}

/// The orientation through a point that gathers most weight around it, and that weight.
fn strongest(
    seed: usize,
    places: &Places,
    weights: &[f64],
    directions: &[[f64; 2]],
    search: &Trace,
    free: Option<&[bool]>,
) -> (f64, [f64; 2]) {
    let points = places.points();
    let centre = points[seed];
    let mut sums = [0.0; ORIENTATIONS];
    let reach = search.reach;
    places.in_box([centre[0] - reach, centre[1] - reach], [centre[0] + reach, centre[1] + reach], |i| {
        let [x, y] = [points[i][0] - centre[0], points[i][1] - centre[1]];
        if x * x + y * y > reach * reach || free.is_some_and(|free| !free[i]) {
            return;
        }
        for (sum, [dx, dy]) in sums.iter_mut().zip(directions) {
            // Full weight on the line, none at twice the band: the best of the coarse orientations stands out.
            let offset = (y * dx - x * dy).abs() / (2.0 * search.band);
            *sum += weights[i] * (1.0 - offset).max(0.0); // no branch: a vector of orientations at a time
        }
    });
    let mut best = 0;
    for i in 1..ORIENTATIONS {
        if sums[i] > sums[best] {
            best = i;
        }
    }
    (sums[best], directions[best])
}

/// Fit and follow a line from a seed until it no longer changes; its members are the points within twice the band.
fn follow(
    seed: usize,
    direction: [f64; 2],
    places: &Places,
    weights: &[f64],
    free: &[bool],
    search: &Trace,
) -> Option<(Line, Vec<usize>)> {
    let points = places.points();
    let start = points[seed];
    let mut ends = [
        start[0] - direction[0] * search.reach,
        start[1] - direction[1] * search.reach,
        start[0] + direction[0] * search.reach,
        start[1] + direction[1] * search.reach,
    ];
    // The first fit takes a wider band: the coarse orientation is off by up to half a step.
    let mut band = 1.5 * search.band;
    let mut margin = 0.0;
    let mut line = None;
    for round in 0..MAX_ROUNDS {
        let mut strip = Vec::new();
        places.in_strip(ends, band, margin, |i, along, offset| {
            if free[i] {
                strip.push((along, offset, i));
            }
        });
        strip.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
        let run = run_of(&strip, seed, search.gap)?;
        let mut sums = Sums::default();
        run.iter().for_each(|&(_, _, i)| sums.add(points[i], weights[i]));
        let (centre, direction) = sums.line()?;
        let along = |i: usize| (points[i][0] - centre[0]) * direction[0] + (points[i][1] - centre[1]) * direction[1];
        let low = run.iter().map(|r| along(r.2)).fold(f64::INFINITY, f64::min);
        let high = run.iter().map(|r| along(r.2)).fold(f64::NEG_INFINITY, f64::max);
        let fitted = [
            centre[0] + low * direction[0],
            centre[1] + low * direction[1],
            centre[0] + high * direction[0],
            centre[1] + high * direction[1],
        ];
        if high - low < 1e-9 {
            return None;
        }
        let settled = round > 2 && moved(ends, fitted) < 1e-4;
        ends = fitted;
        band = search.band;
        // Far enough to follow on, near enough for the direction fitted so far to hold.
        margin = (high - low).max(search.gap);
        line = Some(Line { ends, weight: sums.w });
        if settled {
            break;
        }
    }
    let line = line?;
    let mut members = Vec::new();
    places.in_strip(line.ends, 1.5 * search.band, search.band, |i, _, _| {
        if free[i] {
            members.push(i);
        }
    });
    if !members.contains(&seed) {
        members.push(seed);
    }
    Some((line, members))
}

/// Of a strip in order along the line, the part without wide gaps that holds the seed or, where the line has moved off
/// it, that is heaviest in number.
fn run_of(strip: &[(f64, f64, usize)], seed: usize, gap: f64) -> Option<&[(f64, f64, usize)]> {
    let mut best: Option<&[(f64, f64, usize)]> = None;
    for run in strip.chunk_by(|a, b| b.0 - a.0 <= gap) {
        if run.iter().any(|r| r.2 == seed) {
            return Some(run);
        }
        if best.is_none_or(|b| run.len() > b.len()) {
            best = Some(run);
        }
    }
    best
}

fn length([x1, y1, x2, y2]: [f64; 4]) -> f64 {
    (x2 - x1).hypot(y2 - y1)
}

/// How far the ends of a segment lie from those of another, taken either way round.
fn moved(a: [f64; 4], b: [f64; 4]) -> f64 {
    let between = |b: [f64; 4]| a.iter().zip(b).map(|(p, q)| (p - q).abs()).fold(0.0, f64::max);
    between(b).min(between([b[2], b[3], b[0], b[1]]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points in the order of their cells.
    fn places(mut points: Vec<[f64; 2]>) -> Places {
        let index = |point: &[f64; 2]| point.map(|x| (x / 0.05).floor() as i32);
        points.sort_by_key(index);
        let cells: Vec<_> = points.iter().map(index).collect();
        Places::new(points, &cells, 0.05).unwrap()
    }

    const SEARCH: Trace = Trace { band: 0.03, reach: 0.5, gap: 0.7, min_weight: 5.0, min_length: 0.1 };

    fn row(x0: f64, y0: f64, angle: f64, length: f64) -> Vec<[f64; 2]> {
        let count = (length / 0.05) as usize;
        (0..=count).map(|i| [x0 + i as f64 * 0.05 * angle.cos(), y0 + i as f64 * 0.05 * angle.sin()]).collect()
    }

    #[test]
    fn two_faces_ten_centimetres_apart_stay_two() {
        let mut points = row(0.0, 0.0, 0.3, 6.0);
        points.extend(row(-0.1 * 0.3_f64.sin(), 0.1 * 0.3_f64.cos(), 0.3, 6.0));
        let weights = vec![1.0; points.len()];
        let lines = trace(&places(points), &weights, &SEARCH);
        assert_eq!(lines.len(), 2);
        for line in lines {
            assert!((length(line.ends) - 6.0).abs() < 1e-6, "{line:?}");
        }
    }

    #[test]
    fn a_corner_is_two_lines_and_a_wide_gap_parts_them() {
        let mut points = row(0.0, 0.0, 0.0, 5.0);
        points.extend(row(0.0, 0.05, PI / 2.0, 4.0));
        points.extend(row(6.0, 0.0, 0.0, 2.0));
        let weights = vec![1.0; points.len()];
        let lines = trace(&places(points), &weights, &SEARCH);
        assert_eq!(lines.len(), 3, "{lines:?}");
    }

    #[test]
    fn nothing_is_found_in_nothing() {
        assert!(trace(&places(vec![]), &[], &SEARCH).is_empty());
        assert!(trace(&places(vec![[1.0, 1.0]]), &[1.0], &SEARCH).is_empty());
    }
}
