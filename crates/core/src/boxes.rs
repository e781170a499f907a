//! Boxes turned about points.

/// For each of some directions (cosine, sine): how far each point (m) lies from the nearest side of the box about all of
/// them that is turned so, its sides where `shares` of the points lie below; direction after direction.
pub fn from_sides(points: &[[f64; 2]], directions: &[[f64; 2]], shares: [f64; 2]) -> Vec<f64> {
    let mut found = Vec::with_capacity(points.len() * directions.len());
    let (mut local, mut order) = ([Vec::new(), Vec::new()], Vec::new());
    for &[cos, sin] in directions {
        local[0].clear();
        local[0].extend(points.iter().map(|[x, y]| x * cos + y * sin));
        local[1].clear();
        local[1].extend(points.iter().map(|[x, y]| y * cos - x * sin));
        let sides = [0, 1].map(|axis| {
            order.clear();
            order.extend_from_slice(&local[axis]);
            shares.map(|share| at_share(&mut order, share))
        });
        let off = |axis: usize, place: f64| (place - sides[axis][0]).abs().min((sides[axis][1] - place).abs());
        found.extend(local[0].iter().zip(&local[1]).map(|(&x, &y)| off(0, x).min(off(1, y))));
    }
    found
}

/// The value below which a share of all lies, between two of them where it falls there; 0 of none.
fn at_share(values: &mut [f64], share: f64) -> f64 {
    let place = share * values.len().saturating_sub(1) as f64;
    let first = place as usize;
    if first >= values.len() {
        return 0.0;
    }
    let (_, &mut low, rest) = values.select_nth_unstable_by(first, f64::total_cmp);
    let high = rest.iter().copied().reduce(f64::min).unwrap_or(low);
    // As numpy.percentile has it, to the last bit.
    let part = place - first as f64;
    if part < 0.5 { low + (high - low) * part } else { high - (high - low) * (1.0 - part) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_on_a_turned_box_lie_on_its_sides() {
        let (sin, cos) = 0.3_f64.sin_cos();
        let points: Vec<_> = (0..100)
            .map(|i| {
                let (side, along) = (i % 4, f64::from(i / 4) / 12.5 - 1.0);
                let [x, y] = [[along, -1.0], [along, 1.0], [-2.0, along], [2.0, along]][side as usize];
                [x * cos - y * sin, x * sin + y * cos]
            })
            .collect();
        let off = from_sides(&points, &[[cos, sin], [1.0, 0.0]], [0.1, 0.9]);
        assert_eq!(off.len(), 200);
        assert!(off[..100].iter().all(|off| *off < 1e-9));
        assert!(off[100..].iter().sum::<f64>() > 5.0);
        assert!(from_sides(&[], &[[1.0, 0.0]], [0.1, 0.9]).is_empty());
    }

    #[test]
    fn a_share_lies_between_two_values() {
        assert_eq!(at_share(&mut [3.0, 1.0, 2.0], 0.5), 2.0);
        assert_eq!(at_share(&mut [3.0, 1.0, 2.0], 0.75), 2.5);
        assert_eq!(at_share(&mut [3.0, 1.0, 2.0], 1.0), 3.0);
        assert_eq!(at_share(&mut [7.0], 0.3), 7.0);
    }
}
