//! Closing of gaps where few cells of a grid are filled.

/// How many cells of a grid are filled before and below each.
struct Sums {
    columns: usize,
    sums: Vec<u32>,
}

impl Sums {
    fn new(cells: &[bool], columns: usize) -> Self {
        let wide = columns + 1;
        let mut sums = vec![0; wide];
        for row in cells.chunks_exact(columns) {
            let before = sums.len() - wide;
            let mut in_row = 0;
            sums.push(0);
            for (column, &filled) in row.iter().enumerate() {
                in_row += u32::from(filled);
                sums.push(sums[before + column + 1] + in_row);
            }
        }
        Self { columns, sums }
    }

    /// How many are filled of the cells at most `reach` away from a cell each way.
    fn around(&self, cell: usize, reach: usize) -> u32 {
        let (row, column, wide) = (cell / self.columns, cell % self.columns, self.columns + 1);
        let last = (row + reach + 1).min(self.sums.len() / wide - 1) * wide;
        let first = row.saturating_sub(reach) * wide;
        let (left, right) = (column.saturating_sub(reach), (column + reach + 1).min(self.columns));
        self.sums[last + right] + self.sums[first + left] - self.sums[last + left] - self.sums[first + right]
    }
}

/// Cells (steps, `rows`) with the gaps closed between filled ones of which there are few, never across lines.
///
/// Of `around` x `around` cells less than a `share` is filled there; the closing is by `width` x `width` cells; both
/// are odd. Line i has the steps from `first[i]` to before `first[i + 1]`.
pub fn close_sparse(
    filled: &[bool],
    rows: usize,
    first: &[usize],
    around: usize,
    share: f64,
    width: usize,
) -> Vec<bool> {
    let mut closed = filled.to_vec();
    let (reach, margin) = (width / 2, width - 1);
    let high = rows + 2 * margin;
    let few = share * (around * around) as f64;
    for range in first.windows(2).filter(|_| rows > 0) {
        let line = &mut closed[range[0] * rows..range[1] * rows];
        let mut wider = vec![false; (range[1] - range[0] + 2 * margin) * high];
        for (cells, within) in line.chunks_exact(rows).zip(wider[margin * high..].chunks_exact_mut(high)) {
            within[margin..margin + rows].copy_from_slice(cells);
        }
        let grown =
            windows(&windows(&wider, 1, reach, |one, other| one | other), high, reach, |one, other| one | other);
        let whole =
            windows(&windows(&grown, 1, reach, |one, other| one & other), high, reach, |one, other| one & other);
        let mut sums = None;
        for (cell, filled) in line.iter_mut().enumerate() {
            let cell = (cell / rows + margin) * high + cell % rows + margin;
            if whole[cell] && !*filled {
                let sums = sums.get_or_insert_with(|| Sums::new(&wider, high));
                *filled = f64::from(sums.around(cell, around / 2)) < few;
            }
        }
    }
    closed
}

/// Each cell with those at most `reach` before and after it, `apart` from one another; there are none beyond the ends.
fn windows(cells: &[bool], apart: usize, reach: usize, with: impl Fn(bool, bool) -> bool) -> Vec<bool> {
    let mut found = cells.to_vec();
    for by in (1..=reach).map(|step| step * apart) {
        found[by..].iter_mut().zip(cells).for_each(|(cell, &before)| *cell = with(*cell, before));
        found.iter_mut().zip(&cells[by..]).for_each(|(cell, &after)| *cell = with(*cell, after));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(drawn: &str) -> Vec<bool> {
        drawn.chars().filter(|cell| !cell.is_whitespace()).map(|cell| cell == '#').collect()
    }

    #[test]
    fn gaps_are_closed_where_few_cells_are_filled() {
        let few = cells("#...# ..... ..... ..... #...#");
        assert_eq!(close_sparse(&few, 5, &[0, 5], 9, 0.1, 5), [true; 25]);
        // Beyond the outermost, and between lines, there is no gap.
        assert_eq!(close_sparse(&few, 5, &[0, 2, 5], 9, 0.1, 5), cells("##### ..... ..... ..... #####"));
        assert_eq!(close_sparse(&few, 5, &[0, 5], 9, 0.01, 5), few);
        assert_eq!(close_sparse(&few, 5, &[0, 5], 9, 0.1, 3), few);
    }

    #[test]
    fn without_cells_there_is_nothing_to_close() {
        assert!(close_sparse(&[], 3, &[0], 9, 0.1, 5).is_empty());
        assert!(close_sparse(&[], 0, &[0, 4], 9, 0.1, 5).is_empty());
    }
}
