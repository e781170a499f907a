//! Points within polygons.

/// Which points lie within the rings of a polygon, or of several: holes are rings, too. What lies on an edge may be told
/// either way.
pub fn within(rings: &[Vec<[f64; 2]>], points: &[[f64; 2]]) -> Vec<bool> {
    let edges: Vec<_> = rings
        .iter()
        .flat_map(|ring| ring.iter().zip(ring.iter().cycle().skip(1)))
        .filter(|([_, y1], [_, y2])| y1 != y2)
        .map(|(&[x1, y1], &[x2, y2])| (x1, y1, y2, (x2 - x1) / (y2 - y1)))
        .collect();
    let is_within = |&[x, y]: &[f64; 2]| {
        let crossed = |&(x1, y1, y2, slope): &(f64, f64, f64, f64)| {
            ((y1 > y) != (y2 > y)) & (x < x1 + slope * (y - y1)) // to the right of the point
        };
        edges.iter().fold(false, |is_within, edge| is_within ^ crossed(edge))
    };
    points.iter().map(is_within).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hole_and_what_lies_beside_a_notch_are_outside() {
        let shell = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]];
        let rings = [shell, vec![[0.5, 0.5], [0.5, 1.0], [1.0, 1.0], [1.0, 0.5]]];
        let points = [[0.25, 3.0], [2.0, 2.0], [3.9, 3.5], [0.75, 0.75], [2.0, 0.5], [-1.0, 1.0], [5.0, 0.0]];
        assert_eq!(within(&rings, &points), [true, false, true, false, true, false, false]);
        assert_eq!(within(&[], &points[..1]), [false]);
    }
}
