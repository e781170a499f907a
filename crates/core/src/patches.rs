//! What hangs together: of things by pairs of them that touch, and of the filled cells of a picture.

/// The number of the group that each of `count` things is in, by pairs of things that hang together; groups are numbered
/// by their first thing.
pub fn groups(count: usize, pairs: impl IntoIterator<Item = [usize; 2]>) -> Vec<u32> {
    // Each thing names one before it in its group, or itself.
    let mut before: Vec<usize> = (0..count).collect();
    for pair in pairs {
        let [one, other] = pair.map(|thing| first(&mut before, thing));
        before[one.max(other)] = one.min(other);
    }
    let (mut numbers, mut next) = (vec![0; count], 0);
    for thing in 0..count {
        let first = first(&mut before, thing);
        if first == thing {
            numbers[thing] = next;
            next += 1;
        } else {
            numbers[thing] = numbers[first];
        }
    }
    numbers
}

/// The first thing of a group; who is asked on the way will know it.
fn first(before: &mut [usize], mut thing: usize) -> usize {
    while before[thing] != thing {
        before[thing] = before[before[thing]];
        thing = before[thing];
    }
    thing
}

/// The number of the patch of filled cells that each cell of a picture, of rows of `columns` cells, is in, from 1 on in
/// the order of their first cells, and 0 for cells that are not filled. Cells that touch by a corner hang together.
pub fn patches(filled: &[bool], columns: usize) -> Vec<u32> {
    let cells: Vec<usize> = (0..filled.len()).filter(|&cell| filled[cell]).collect();
    let mut numbers = vec![0; filled.len()];
    for (number, &cell) in (0..).zip(&cells) {
        numbers[cell] = number;
    }
    // Those that come before a cell: on its left, and in the row above.
    let mut pairs = Vec::new();
    for &cell in &cells {
        let (row, column) = (cell / columns, cell % columns);
        for (up, aside) in [(0, -1), (1, -1), (1, 0), (1, 1)] {
            let other = row.checked_sub(up).zip(column.checked_add_signed(aside).filter(|&other| other < columns));
            let other = other.map(|(row, column)| row * columns + column).filter(|&other| filled[other]);
            pairs.extend(other.map(|other| [cell, other].map(|cell| numbers[cell] as usize)));
        }
    }
    for (&cell, group) in cells.iter().zip(groups(cells.len(), pairs)) {
        numbers[cell] = group + 1;
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_numbered_by_their_first() {
        assert_eq!(groups(6, [[4, 1], [5, 3], [1, 5]]), [0, 1, 2, 1, 1, 1]);
        assert_eq!(groups(3, [[2, 0], [0, 0]]), [0, 1, 0]);
        assert!(groups(0, []).is_empty());
    }

    #[test]
    fn patches_are_what_spreads_from_their_first_cells() {
        let (rows, columns) = (40, 23);
        let filled: Vec<bool> = (0..rows * columns).map(|i| i * i * 7 % 31 < 7 || i % columns == 4).collect();
        let mut expected = vec![0; filled.len()];
        let mut next = 0;
        for seed in 0..filled.len() {
            if !filled[seed] || expected[seed] > 0 {
                continue;
            }
            next += 1;
            let mut reached = vec![seed];
            while let Some(cell) = reached.pop() {
                expected[cell] = next;
                reached.extend((0..filled.len()).filter(|&other| {
                    filled[other]
                        && expected[other] == 0
                        && (other / columns).abs_diff(cell / columns) <= 1
                        && (other % columns).abs_diff(cell % columns) <= 1
                }));
            }
        }
        assert!(next > 3);
        assert_eq!(patches(&filled, columns), expected);
        assert_eq!(patches(&[true, false, true, true], 1), [1, 0, 2, 2]);
        assert!(patches(&[], 5).is_empty());
    }
}
