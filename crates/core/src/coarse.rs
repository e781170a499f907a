//! Voxels put together to coarser ones, and those that stand alone told from those in company.

use rustc_hash::FxHashMap;

/// Voxels along the side of a cube in which company is counted, as a power of two: a cube is a bit each of a word.
const CUBE_BITS: u32 = 2;
const SIGN: u32 = 1 << 31;

/// The index of the voxel of `factor` times the size that each voxel lies in.
fn coarse(index: &[[i32; 3]], factor: i32) -> impl Iterator<Item = [i32; 3]> {
    let (mut last, mut column) = ([0; 2], [0; 2]);
    index.iter().map(move |&[x, y, z]| {
        // Voxels of one column follow one another.
        if [x, y] != last {
            last = [x, y];
            column = last.map(|i| i.div_euclid(factor));
        }
        [column[0], column[1], z.div_euclid(factor)]
    })
}

/// The different voxels of `factor` times the size, sorted, of voxels that are sorted.
pub fn coarser(index: &[[i32; 3]], factor: i32) -> Vec<[i32; 3]> {
    let mut found = Vec::new();
    let mut slab = Vec::new();
    for same in index.chunk_by(|one, other| one[0].div_euclid(factor) == other[0].div_euclid(factor)) {
        slab.clear();
        // One number for y and z that has their order.
        slab.extend(
            coarse(same, factor).map(|[_, y, z]| u64::from(y as u32 ^ SIGN) << 32 | u64::from(z as u32 ^ SIGN)),
        );
        slab.dedup();
        slab.sort_unstable();
        slab.dedup();
        let x = same[0][0].div_euclid(factor);
        found.extend(slab.iter().map(|&key| [x, ((key >> 32) as u32 ^ SIGN) as i32, (key as u32 ^ SIGN) as i32]));
    }
    found
}

/// Which voxels lie in cubes of four voxels a side, each `factor` times the size, in which and in the 26 around which
/// there are `least` or more of those.
pub fn in_company(index: &[[i32; 3]], factor: i32, least: u32) -> Vec<bool> {
    let mut numbers = FxHashMap::<[i32; 3], usize>::default();
    let mut filled = Vec::<u64>::new();
    // Runs of voxels in one cube: its number, and how many they are.
    let mut runs = Vec::<(usize, usize)>::new();
    let mut last = None;
    for voxel in coarse(index, factor) {
        let cube = voxel.map(|i| i >> CUBE_BITS);
        if last != Some(cube) {
            last = Some(cube);
            let number = *numbers.entry(cube).or_insert(filled.len());
            if number == filled.len() {
                filled.push(0);
            }
            runs.push((number, 0));
        }
        let [x, y, z] = voxel.map(|i| i & ((1 << CUBE_BITS) - 1));
        if let Some((number, length)) = runs.last_mut() {
            filled[*number] |= 1 << ((x << CUBE_BITS | y) << CUBE_BITS | z);
            *length += 1;
        }
    }
    let mut kept = vec![true; filled.len()];
    for (&[x, y, z], &number) in &numbers {
        if filled[number].count_ones() < least {
            let around = (0..27).map(|i| [x + i / 9 - 1, y + i / 3 % 3 - 1, z + i % 3 - 1]);
            kept[number] =
                around.filter_map(|at| numbers.get(&at)).map(|&i| filled[i].count_ones()).sum::<u32>() >= least;
        }
    }
    runs.into_iter().flat_map(|(number, length)| std::iter::repeat_n(kept[number], length)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn index() -> Vec<[i32; 3]> {
        let mut index: Vec<_> = (0..3_000)
            .map(|i| [i * 37 % 61 - 30, i * 91 % 83 - 40, i * i % 53 - 20].map(|i: i32| i * i.abs() / 20))
            .collect();
        index.sort_unstable();
        index.dedup();
        index
    }

    #[test]
    fn coarser_voxels_are_those_of_a_search_through_all() {
        for factor in [1, 2, 3] {
            let mut expected: Vec<_> = index().iter().map(|voxel| voxel.map(|i| i.div_euclid(factor))).collect();
            expected.sort_unstable();
            expected.dedup();
            assert_eq!(coarser(&index(), factor), expected);
        }
        assert!(coarser(&[], 2).is_empty());
    }

    #[test]
    fn company_is_what_a_search_through_all_finds() {
        for (factor, least) in [(1, 8), (2, 5), (2, 30)] {
            let coarser = coarser(&index(), factor);
            let is_near = |a: &[i32; 3], b: &[i32; 3]| {
                (0..3).all(|axis| (a[axis].div_euclid(4) - b[axis].div_euclid(4)).abs() <= 1)
            };
            let expected: Vec<_> = index()
                .iter()
                .map(|voxel| voxel.map(|i| i.div_euclid(factor)))
                .map(|voxel| coarser.iter().filter(|other| is_near(&voxel, other)).count() >= least as usize)
                .collect();
            assert!(expected.contains(&true) && expected.contains(&false));
            assert_eq!(in_company(&index(), factor, least), expected);
        }
        assert!(in_company(&[], 2, 8).is_empty());
        assert_eq!(in_company(&[[-5, 7, 1]], 1, 1), [true]);
    }
}
