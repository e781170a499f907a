//! Points of the ground plane, found by place.

/// Points sorted into square cells, for looking up those near a place or a segment.
pub struct Neighbours<'a> {
    points: &'a [[f64; 2]],
    cell: f64,
    low: [f64; 2],
    shape: [usize; 2],
    /// Where each cell's points start in `order`.
    starts: Vec<u32>,
    order: Vec<u32>,
}

/// At most this many cells: what lies far apart shares larger ones.
const MAX_CELLS: f64 = 1e8;

impl<'a> Neighbours<'a> {
    /// Sort points (m) into cells of `cell` metres, or larger where the points lie far apart.
    pub fn new(points: &'a [[f64; 2]], cell: f64) -> Self {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for point in points {
            for axis in 0..2 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        if points.is_empty() {
            (low, high) = ([0.0; 2], [0.0; 2]);
        }
        let area = (high[0] - low[0] + cell) * (high[1] - low[1] + cell);
        let cell = cell.max((area / MAX_CELLS).sqrt());
        let shape = [0, 1].map(|axis| ((high[axis] - low[axis]) / cell) as usize + 1);
        let mut this = Self { points, cell, low, shape, starts: vec![0; shape[0] * shape[1] + 1], order: Vec::new() };
        let cells: Vec<usize> = points.iter().map(|&point| this.cell_of(point)).collect();
        cells.iter().for_each(|&cell| this.starts[cell + 1] += 1);
        for i in 1..this.starts.len() {
            this.starts[i] += this.starts[i - 1];
        }
        let mut next = this.starts.clone();
        this.order = vec![0; points.len()];
        for (i, &cell) in cells.iter().enumerate() {
            this.order[next[cell] as usize] = i as u32;
            next[cell] += 1;
        }
        this
    }

    fn cell_of(&self, point: [f64; 2]) -> usize {
        let [x, y] = self.clamped(point);
        x * self.shape[1] + y
    }

    fn clamped(&self, point: [f64; 2]) -> [usize; 2] {
        [0, 1].map(|axis| (((point[axis] - self.low[axis]) / self.cell).max(0.0) as usize).min(self.shape[axis] - 1))
    }

    /// Hand on the index of every point in the cells that a rectangle (m) touches.
    pub fn in_box(&self, low: [f64; 2], high: [f64; 2], mut found: impl FnMut(usize)) {
        let ([x0, y0], [x1, y1]) = (self.clamped(low), self.clamped(high));
        for x in x0..=x1 {
            let row = x * self.shape[1];
            let (start, end) = (self.starts[row + y0] as usize, self.starts[row + y1 + 1] as usize);
            self.order[start..end].iter().for_each(|&i| found(i as usize));
        }
    }

    /// Hand on every point within `half_width` (m) of a segment's line and at most `margin` (m) beyond its ends, as
    /// (index, distance along from the start, offset to the left).
    pub fn in_strip(&self, segment: [f64; 4], half_width: f64, margin: f64, mut found: impl FnMut(usize, f64, f64)) {
        let [x1, y1, x2, y2] = segment;
        let length = (x2 - x1).hypot(y2 - y1);
        if length == 0.0 {
            return;
        }
        let [dx, dy] = [(x2 - x1) / length, (y2 - y1) / length];
        // A long strip is walked in pieces, so that a slanting one does not search its whole bounding box.
        let pieces = ((length + 2.0 * margin) / (4.0 * self.cell + half_width)).ceil().max(1.0);
        let step = (length + 2.0 * margin) / pieces;
        let reach = half_width + step / 2.0;
        for piece in 0..pieces as usize {
            let from = piece as f64 * step - margin;
            let to = if piece as f64 + 1.0 == pieces { length + margin } else { from + step };
            let last = piece as f64 + 1.0 == pieces;
            let centre = [x1 + dx * (from + to) / 2.0, y1 + dy * (from + to) / 2.0];
            let half = [reach.min(dx.abs() * step / 2.0 + half_width), reach.min(dy.abs() * step / 2.0 + half_width)];
            self.in_box([centre[0] - half[0], centre[1] - half[1]], [centre[0] + half[0], centre[1] + half[1]], |i| {
                let [rx, ry] = [self.points[i][0] - x1, self.points[i][1] - y1];
                let (along, offset) = (rx * dx + ry * dy, ry * dx - rx * dy);
                if offset.abs() <= half_width && along >= from && (along < to || (last && along <= to)) {
                    found(i, along, offset);
                }
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_strip_holds_what_a_search_through_all_points_finds() {
        let points: Vec<[f64; 2]> =
            (0..2_000).map(|i| [f64::from(i * 37 % 401) * 0.05, f64::from(i * 91 % 397) * 0.05]).collect();
        let neighbours = Neighbours::new(&points, 0.3);
        for segment in [[1.0, 1.0, 18.0, 12.0], [5.0, 19.0, 5.0, 2.0], [3.0, 3.0, 3.4, 3.1]] {
            let mut found = Vec::new();
            neighbours.in_strip(segment, 0.21, 0.5, |i, _, _| found.push(i));
            found.sort_unstable();
            let [x1, y1, x2, y2] = segment;
            let length = (x2 - x1).hypot(y2 - y1);
            let expected: Vec<usize> = (0..points.len())
                .filter(|&i| {
                    let [rx, ry] = [points[i][0] - x1, points[i][1] - y1];
                    let along = (rx * (x2 - x1) + ry * (y2 - y1)) / length;
                    let offset = (ry * (x2 - x1) - rx * (y2 - y1)) / length;
                    offset.abs() <= 0.21 && (-0.5..=length + 0.5).contains(&along)
                })
                .collect();
            assert_eq!(found, expected);
        }
    }
}
