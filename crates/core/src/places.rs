//! Points that lie on a lattice of ground cells and come in its order, found by place.
//!
//! The voxels of a storey come so: each row of cells is a run of them, and what a strip or a box holds of a row is a run
//! again. Nothing is sorted, and what is found comes in the order of the points.

use crate::{Error, Result};

/// Points sorted by their cells.
pub struct Places {
    cell: f64,
    points: Vec<[f64; 2]>,
    /// Index of each cell, in order, and where its points start.
    cells: Vec<([i32; 2], u32)>,
    /// Where the cells of each row start, and past the last.
    rows: Vec<usize>,
}

/// A point may lie this far out of its cell by rounding, m.
const ROUNDING: f64 = 1e-6;

impl Places {
    /// Points (m), and the cell of `cell` metres that each lies in; sorted by cell.
    pub fn new(points: Vec<[f64; 2]>, index: &[[i32; 2]], cell: f64) -> Result<Self> {
        if points.len() != index.len() || !index.is_sorted() {
            return Err(Error::BadArgument("places: expected points sorted by their cells".into()));
        }
        let mut cells: Vec<([i32; 2], u32)> = Vec::new();
        let mut rows = Vec::new();
        for (i, &at) in index.iter().enumerate() {
            let last = cells.last().map(|&(last, _)| last);
            if last != Some(at) {
                if last.is_none_or(|last| last[0] != at[0]) {
                    rows.push(cells.len());
                }
                cells.push((at, i as u32));
            }
        }
        rows.push(cells.len());
        Ok(Self { cell, points, cells, rows })
    }

    /// The points (m), in their order.
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points
    }

    /// Hand on the runs of points in those cells of the rows from `low` to `high` (m, across the rows) that lie in
    /// `along` (from, to; m, along them), which is told the ends of each row.
    fn in_rows(
        &self,
        [low, high]: [f64; 2],
        along: impl Fn([f64; 2]) -> Option<[f64; 2]>,
        mut found: impl FnMut(std::ops::Range<usize>),
    ) {
        let index = |place: f64| (place / self.cell).floor() as i32;
        let row_of = |row: usize| self.cells[self.rows[row]].0[0];
        let count = self.rows.len() - 1;
        let (mut from, mut end) = (0, count);
        // The first row that is not below.
        let lowest = index(low - ROUNDING);
        while from < end {
            let middle = usize::midpoint(from, end);
            if row_of(middle) < lowest { from = middle + 1 } else { end = middle }
        }
        for row in from..count {
            let x = row_of(row);
            if x > index(high + ROUNDING) {
                break;
            }
            let ends = [f64::from(x) * self.cell - ROUNDING, f64::from(x + 1) * self.cell + ROUNDING];
            let Some([least, most]) = along(ends) else { continue };
            let cells = &self.cells[self.rows[row]..self.rows[row + 1]];
            let first = cells.partition_point(|&([_, y], _)| y < index(least - ROUNDING));
            let last = first + cells[first..].partition_point(|&([_, y], _)| y <= index(most + ROUNDING));
            let start = |cell: usize| {
                self.cells.get(self.rows[row] + cell).map_or(self.points.len(), |&(_, start)| start as usize)
            };
            found(start(first)..start(last));
        }
    }

    /// Hand on the index of every point in a rectangle (m), in order.
    pub fn in_box(&self, low: [f64; 2], high: [f64; 2], mut found: impl FnMut(usize)) {
        self.in_rows(
            [low[0], high[0]],
            |_| Some([low[1], high[1]]),
            |points| {
                for (i, &[x, y]) in points.clone().zip(&self.points[points]) {
                    if (x >= low[0]) & (x <= high[0]) & (y >= low[1]) & (y <= high[1]) {
                        found(i);
                    }
                }
            },
        );
    }

    /// Hand on every point within `half_width` (m) of a segment's line and at most `margin` (m) beyond its ends, as
    /// (index, distance along from the start, offset to the left), in order.
    pub fn in_strip(&self, segment: [f64; 4], half_width: f64, margin: f64, mut found: impl FnMut(usize, f64, f64)) {
        let [x1, y1, x2, y2] = segment;
        let length = (x2 - x1).hypot(y2 - y1);
        if length == 0.0 {
            return;
        }
        let [dx, dy] = [(x2 - x1) / length, (y2 - y1) / length];
        let corners = [(-margin, -1.0), (length + margin, -1.0), (length + margin, 1.0), (-margin, 1.0)]
            .map(|(s, side)| [x1 + s * dx - side * half_width * dy, y1 + s * dy + side * half_width * dx]);
        let low = corners.iter().map(|corner| corner[0]).fold(f64::INFINITY, f64::min);
        let high = corners.iter().map(|corner| corner[0]).fold(f64::NEG_INFINITY, f64::max);
        self.in_rows(
            [low, high],
            |ends| between(&corners, ends),
            |points| {
                for (i, [x, y]) in points.clone().zip(&self.points[points]) {
                    let [rx, ry] = [x - x1, y - y1];
                    let (along, offset) = (rx * dx + ry * dy, ry * dx - rx * dy);
                    if (offset.abs() <= half_width) & (along >= -margin) & (along <= length + margin) {
                        found(i, along, offset);
                    }
                }
            },
        );
    }
}

/// The least and the greatest y of the part of a convex polygon that lies between two x; None where none does.
fn between(corners: &[[f64; 2]; 4], [low, high]: [f64; 2]) -> Option<[f64; 2]> {
    let mut ends: Option<[f64; 2]> = None;
    for (i, &[ax, ay]) in corners.iter().enumerate() {
        let [bx, by] = corners[(i + 1) % corners.len()];
        if ax.max(bx) < low || ax.min(bx) > high {
            continue;
        }
        for x in [ax.clamp(low, high), bx.clamp(low, high)] {
            let y = if (bx - ax).abs() < 1e-12 { [ay, by] } else { [ay + (by - ay) * (x - ax) / (bx - ax); 2] };
            let [least, most] = ends.unwrap_or([f64::INFINITY, f64::NEG_INFINITY]);
            ends = Some([least.min(y[0]).min(y[1]), most.max(y[0]).max(y[1])]);
        }
    }
    ends
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places() -> (Vec<[f64; 2]>, Places) {
        let mut points: Vec<[f64; 2]> = (0..4_000)
            .map(|i| [f64::from(i * 37 % 401) * 0.0131 - 2.0, f64::from(i * 91 % 397) * 0.017 - 3.0])
            .collect();
        let index = |point: &[f64; 2]| point.map(|x| (x / 0.05).floor() as i32);
        points.sort_by_key(index);
        let cells: Vec<_> = points.iter().map(index).collect();
        (points.clone(), Places::new(points, &cells, 0.05).unwrap())
    }

    #[test]
    fn strips_hold_what_a_search_through_all_points_finds_in_order() {
        let (points, places) = places();
        for segment in [
            [-1.0, -1.0, 2.0, 1.5],
            [0.5, 2.0, 0.5, -2.5],
            [3.0, 0.0, -2.0, 0.0],
            [0.3, 0.3, 0.34, 0.31],
            [1.0, 1.0, 1.0, 1.0],
            [-9.0, -8.0, 9.0, 9.5],
        ] {
            for (half_width, margin) in [(0.21, 0.5), (0.03, 0.0), (1.0, 0.1)] {
                let mut found = Vec::new();
                places.in_strip(segment, half_width, margin, |i, along, offset| found.push((i, along, offset)));
                let [x1, y1, x2, y2]: [f64; 4] = segment;
                let length = (x2 - x1).hypot(y2 - y1);
                let (dx, dy) = ((x2 - x1) / length, (y2 - y1) / length);
                let all = points
                    .iter()
                    .enumerate()
                    .map(|(i, [x, y])| (i, (x - x1) * dx + (y - y1) * dy, (y - y1) * dx - (x - x1) * dy));
                let within = |&(_, along, offset): &(usize, f64, f64)| {
                    offset.abs() <= half_width && along >= -margin && along <= length + margin
                };
                assert_eq!(found, all.filter(within).collect::<Vec<_>>()); // none about a segment without a direction
            }
        }
    }

    #[test]
    fn boxes_hold_what_a_search_through_all_points_finds() {
        let (points, places) = places();
        for (low, high) in [([-0.5, -0.5], [0.7, 0.3]), ([-9.0, 0.0], [9.0, 0.2]), ([5.0, 5.0], [6.0, 6.0])] {
            let mut found = Vec::new();
            places.in_box(low, high, |i| found.push(i));
            let inside = |p: &[f64; 2]| (0..2).all(|axis| p[axis] >= low[axis] && p[axis] <= high[axis]);
            let expected: Vec<_> = (0..points.len()).filter(|&i| inside(&points[i])).collect();
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn without_points_nothing_is_found() {
        let places = Places::new(Vec::new(), &[], 0.05).unwrap();
        places.in_box([-1.0; 2], [1.0; 2], |_| panic!());
        places.in_strip([0.0, 0.0, 1.0, 1.0], 1.0, 1.0, |_, _, _| panic!());
    }

    #[test]
    fn points_out_of_order_are_refused() {
        assert!(Places::new(vec![[0.0; 2]; 2], &[[1, 0], [0, 5]], 0.05).is_err());
        assert!(Places::new(vec![[0.0; 2]; 2], &[[1, 0]], 0.05).is_err());
    }
}
