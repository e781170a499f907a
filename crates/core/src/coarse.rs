//! Voxels put together to coarser ones, and those that stand alone told from those in company.

use rustc_hash::FxHashMap;

/// Voxels along the side of a cube in which company is counted, as a power of two: a cube is a bit each of a word.
const CUBE_BITS: u32 = 2;
/// Places of a slab for each voxel in it, beyond which voxels are sorted: strays stand far from all others.
const MAX_EMPTY: usize = 100;
/// Cubes one above the other that are kept together, as a power of two.
const STACK_BITS: u32 = 4;
/// Stacks that are remembered, as a power of two.
const RECENT_BITS: u32 = 12;

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
    let (mut slab, mut bits) = (Vec::new(), Vec::new());
    for same in index.chunk_by(|one, other| one[0].div_euclid(factor) == other[0].div_euclid(factor)) {
        let x = same[0][0].div_euclid(factor);
        slab.clear();
        slab.extend(coarse(same, factor).map(|[_, y, z]| [y, z]));
        slab.dedup();
        let (mut low, mut high) = ([i32::MAX; 2], [i32::MIN; 2]);
        for voxel in &slab {
            for axis in 0..2 {
                low[axis] = low[axis].min(voxel[axis]);
                high[axis] = high[axis].max(voxel[axis]);
            }
        }
        let [wide, tall] = [0, 1].map(|axis| (i64::from(high[axis]) - i64::from(low[axis]) + 1) as usize);
        if wide.saturating_mul(tall) > MAX_EMPTY * slab.len() {
            slab.sort_unstable();
            slab.dedup();
            found.extend(slab.iter().map(|&[y, z]| [x, y, z]));
            continue;
        }
        // A bit for each place of the slab puts them in order by itself.
        bits.clear();
        bits.resize((wide * tall).div_ceil(64), 0_u64);
        for &[y, z] in &slab {
            let place = (y - low[0]) as usize * tall + (z - low[1]) as usize;
            bits[place / 64] |= 1 << (place % 64);
        }
        for (first, &word) in (0..).step_by(64).zip(&bits) {
            let mut left = word;
            while left != 0 {
                let place = first + left.trailing_zeros() as usize;
                found.push([x, low[0] + (place / tall) as i32, low[1] + (place % tall) as i32]);
                left &= left - 1;
            }
        }
    }
    found
}

/// Which voxels lie in cubes of four voxels a side, each `factor` times the size, in which and in the 26 around which
/// there are `least` or more of those.
pub fn in_company(index: &[[i32; 3]], factor: i32, least: u32) -> Vec<bool> {
    let mut stacks = Stacks::new();
    // Runs of voxels in one cube: where it is, and how many they are.
    let mut runs = Vec::<(usize, usize)>::new();
    let (mut last, mut at) = (None, 0);
    let mut filled = Vec::<u64>::new();
    for voxel in coarse(index, factor) {
        let cube = voxel.map(|i| i >> CUBE_BITS);
        if last != Some(cube) {
            last = Some(cube);
            let [x, y, z] = cube;
            let stack = stacks.number([x, y, z >> STACK_BITS]);
            at = stack << STACK_BITS | (z & ((1 << STACK_BITS) - 1)) as usize;
            filled.resize(stacks.keys.len() << STACK_BITS, 0);
            runs.push((at, 0));
        }
        let [x, y, z] = voxel.map(|i| i & ((1 << CUBE_BITS) - 1));
        filled[at] |= 1 << ((x << CUBE_BITS | y) << CUBE_BITS | z);
        if let Some((_, length)) = runs.last_mut() {
            *length += 1;
        }
    }
    let counts: Vec<u32> = filled.iter().map(|cube| cube.count_ones()).collect();
    let mut kept: Vec<bool> = counts.iter().map(|&count| count >= least).collect();
    for (stack, &[x, y, z]) in stacks.keys.iter().enumerate() {
        let cubes = stack << STACK_BITS..(stack + 1) << STACK_BITS;
        let is_asked = |cube: usize| counts[cube] > 0 && !kept[cube];
        if !cubes.clone().any(is_asked) {
            continue;
        }
        let asks = [is_asked(cubes.start), is_asked(cubes.end - 1)];
        // Of the stacks around it and the ends of those above and below: how many voxels each layer holds.
        let mut layers = [0; (1 << STACK_BITS) + 2];
        for (dx, dy) in (0..9).map(|i| (i / 3 - 1, i % 3 - 1)) {
            if let Some(&near) = stacks.numbers.get(&[x + dx, y + dy, z]) {
                let near = &counts[near << STACK_BITS..(near + 1) << STACK_BITS];
                layers[1..].iter_mut().zip(near).for_each(|(sum, count)| *sum += count);
            }
            if asks[0]
                && let Some(&below) = stacks.numbers.get(&[x + dx, y + dy, z - 1])
            {
                layers[0] += counts[((below + 1) << STACK_BITS) - 1];
            }
            if asks[1]
                && let Some(&above) = stacks.numbers.get(&[x + dx, y + dy, z + 1])
            {
                layers[(1 << STACK_BITS) + 1] += counts[above << STACK_BITS];
            }
        }
        for (cube, about) in cubes.zip(layers.windows(3)) {
            kept[cube] = about.iter().sum::<u32>() >= least;
        }
    }
    runs.into_iter().flat_map(|(cube, length)| std::iter::repeat_n(kept[cube], length)).collect()
}

/// Cubes one above the other, by where they stand, numbered as they come.
struct Stacks {
    numbers: FxHashMap<[i32; 3], usize>,
    keys: Vec<[i32; 3]>,
    /// Those that were asked for of late: of sorted voxels the same come again with each layer.
    recent: Vec<Option<([i32; 3], usize)>>,
}

impl Stacks {
    fn new() -> Self {
        Self { numbers: FxHashMap::default(), keys: Vec::new(), recent: vec![None; 1 << RECENT_BITS] }
    }

    fn number(&mut self, key: [i32; 3]) -> usize {
        let slot = (key[1].wrapping_mul(7).wrapping_add(key[2]) & ((1 << RECENT_BITS) - 1)) as usize;
        if let Some((known, number)) = self.recent[slot]
            && known == key
        {
            return number;
        }
        let number = *self.numbers.entry(key).or_insert(self.keys.len());
        if number == self.keys.len() {
            self.keys.push(key);
        }
        self.recent[slot] = Some((key, number));
        number
    }
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
