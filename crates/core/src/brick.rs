//! Bricks: 8 x 8 x 8 voxels that lie together, and what is kept of the points in each.

/// Side of a brick as a power of two.
pub(crate) const SIDE_BITS: u32 = 3;
/// Voxels along the side of a brick.
pub const SIDE: i32 = 1 << SIDE_BITS;
/// Voxels of a brick.
pub(crate) const BRICK_VOXELS: usize = 1 << (3 * SIDE_BITS);
/// Up to this many voxels a brick is searched through; with more it gets a table of its slots.
const SEARCHED_VOXELS: usize = 8;
/// Voxels of a brick through which a wall passes.
const USUAL_VOXELS: usize = 1 << (2 * SIDE_BITS);

/// Sums over the points of a voxel; offsets are from its lower corner, in quanta.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[repr(C)]
pub struct Moments {
    /// Number of points.
    pub count: u64,
    /// Sums of x, y and z.
    pub sum: [u64; 3],
    /// Sums of xx, xy and yy.
    pub products: [u64; 3],
}

impl Moments {
    /// Saturating: points never come near, but an evidence file may claim anything.
    fn add(&mut self, other: &Self) {
        self.count = self.count.saturating_add(other.count);
        for (sum, value) in self.sum.iter_mut().zip(other.sum) {
            *sum = sum.saturating_add(value);
        }
        for (sum, value) in self.products.iter_mut().zip(other.products) {
            *sum = sum.saturating_add(value);
        }
    }
}

/// What is kept of the points in a brick. A place is a voxel's number within the brick: x, then y, then z.
pub(crate) trait Cells: Default + Clone + Send + Sync {
    /// Whether it matters where in its voxel a point lies.
    const WANTS_OFFSETS: bool;
    /// A brick of voxels at different places.
    fn of(voxels: &[(u16, Moments)]) -> Self;
    /// Points: the place of each, and where it lies from the lower corner of its voxel, in quanta. 32 bits hold the sums
    /// of `most` points.
    fn add_points(&mut self, points: impl Iterator<Item = (u16, [u32; 3])>, most: u32);
    /// All that is summed up in `moments`.
    fn add(&mut self, place: u16, moments: &Moments);
    /// All that another brick holds.
    fn merge(&mut self, other: &Self);
    /// Number of occupied voxels.
    fn len(&self) -> usize;
    /// Hand on the occupied voxels, in the order of their places.
    fn each(&self, take: impl FnMut(u16, &Moments));
}

/// A voxel in which there are points: half a line of the cache.
#[derive(Debug, Clone)]
#[repr(C, align(32))]
struct Occupied {
    count: u32,
    sum: [u32; 3],
    products: [u32; 3],
    place: u16,
}

impl Occupied {
    fn new(place: u16) -> Self {
        Self { count: 0, sum: [0; 3], products: [0; 3], place }
    }

    #[inline]
    fn add_point(&mut self, offset: [u32; 3]) {
        let [x, y, _] = offset;
        self.count += 1;
        for (sum, value) in self.sum.iter_mut().zip(offset) {
            *sum += value;
        }
        for (sum, value) in self.products.iter_mut().zip([x * x, x * y, y * y]) {
            *sum += value;
        }
    }

    fn moments(&self) -> Moments {
        Moments { count: self.count.into(), sum: self.sum.map(u64::from), products: self.products.map(u64::from) }
    }

    /// Sums with those of `more`, if 32 bits hold them.
    fn with(&self, more: &Moments) -> Option<Self> {
        let mut all = self.moments();
        all.add(more);
        let [x, y, z] = all.sum.map(|sum| u32::try_from(sum).ok());
        let [xx, xy, yy] = all.products.map(|sum| u32::try_from(sum).ok());
        let count = u32::try_from(all.count).ok()?;
        Some(Self { count, sum: [x?, y?, z?], products: [xx?, xy?, yy?], place: self.place })
    }
}

/// Sums for each occupied voxel; only these take room.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sums {
    /// In order of arrival.
    voxels: Vec<Occupied>,
    /// Where each place stands in `voxels`, plus one; made once one is looked up among more than a few.
    slots: Option<Box<[u16; BRICK_VOXELS]>>,
    /// What the first voxels have besides, because 32 bits did not hold it.
    large: Vec<Moments>,
}

impl Sums {
    /// Where the voxel of a place stands.
    #[inline]
    fn find(&mut self, place: u16) -> usize {
        if self.slots.is_none() && self.voxels.len() > SEARCHED_VOXELS {
            self.make_slots();
        }
        let slot = match &self.slots {
            Some(slots) => usize::from(slots[usize::from(place)]),
            None => self.voxels.iter().position(|voxel| voxel.place == place).map_or(0, |i| i + 1),
        };
        if slot > 0 { slot - 1 } else { self.insert(place) }
    }

    #[cold]
    fn insert(&mut self, place: u16) -> usize {
        if self.voxels.is_empty() {
            self.voxels.reserve_exact(1); // a stray has a brick of its own and stays alone there
        }
        self.voxels.push(Occupied::new(place));
        if let Some(slots) = &mut self.slots {
            slots[usize::from(place)] = self.voxels.len() as u16;
        }
        self.voxels.len() - 1
    }

    #[cold]
    fn make_slots(&mut self) {
        self.voxels.reserve(USUAL_VOXELS - self.voxels.len()); // it will hardly stay at what can be searched through
        let mut slots = Box::new([0; BRICK_VOXELS]);
        for (slot, voxel) in (1..).zip(&self.voxels) {
            slots[usize::from(voxel.place)] = slot;
        }
        self.slots = Some(slots);
    }

    /// Make room in a voxel: its sums go where there is more of it.
    #[cold]
    fn empty(&mut self, index: usize) {
        let voxel = &mut self.voxels[index];
        let moments = voxel.moments();
        *voxel = Occupied::new(voxel.place);
        self.add_large(index, &moments);
    }

    fn add_large(&mut self, index: usize, moments: &Moments) {
        if self.large.len() <= index {
            self.large.resize(index + 1, Moments::default());
        }
        self.large[index].add(moments);
    }

    fn add_at(&mut self, index: usize, moments: &Moments) {
        match self.voxels[index].with(moments) {
            Some(sum) => self.voxels[index] = sum,
            None => self.add_large(index, moments),
        }
    }

    /// All sums of a voxel.
    fn moments(&self, index: usize) -> Moments {
        let mut moments = self.voxels[index].moments();
        if let Some(large) = self.large.get(index) {
            moments.add(large);
        }
        moments
    }
}

impl Cells for Sums {
    const WANTS_OFFSETS: bool = true;

    fn of(voxels: &[(u16, Moments)]) -> Self {
        let mut sums = Self { voxels: Vec::with_capacity(voxels.len()), ..Self::default() };
        for (index, (place, moments)) in voxels.iter().enumerate() {
            sums.voxels.push(Occupied::new(*place));
            sums.add_at(index, moments);
        }
        sums
    }

    #[inline]
    fn add_points(&mut self, mut points: impl Iterator<Item = (u16, [u32; 3])>, most: u32) {
        let mut next = points.next();
        while let Some((place, offset)) = next {
            let index = self.find(place);
            if self.voxels[index].count >= most {
                self.empty(index);
            }
            self.voxels[index].add_point(offset);
            next = points.next();
            // As long as voxels are known and have room, nothing of this has to be asked again.
            let Some(slots) = &self.slots else { continue };
            while let Some((place, offset)) = next {
                let index = usize::from(slots[usize::from(place) % BRICK_VOXELS]).wrapping_sub(1);
                let Some(voxel) = self.voxels.get_mut(index).filter(|voxel| voxel.count < most) else { break };
                voxel.add_point(offset);
                next = points.next();
            }
        }
    }

    fn add(&mut self, place: u16, moments: &Moments) {
        let index = self.find(place);
        self.add_at(index, moments);
    }

    fn merge(&mut self, other: &Self) {
        other.each(|place, moments| self.add(place, moments));
    }

    fn len(&self) -> usize {
        self.voxels.len()
    }

    fn each(&self, mut take: impl FnMut(u16, &Moments)) {
        // No sorting: a bit for each place that is occupied, and where it stands.
        let (mut occupied, mut slots) = (Bits::default(), [0_u16; BRICK_VOXELS]);
        for (slot, voxel) in (0..).zip(&self.voxels) {
            occupied.set(voxel.place);
            slots[usize::from(voxel.place)] = slot;
        }
        occupied.each(|place, _| take(place, &self.moments(usize::from(slots[usize::from(place)]))));
    }
}

/// One bit for each voxel.
#[derive(Debug, Clone, Default)]
pub(crate) struct Bits([u64; BRICK_VOXELS / 64]);

impl Bits {
    #[inline]
    fn set(&mut self, place: u16) {
        let (word, bit) = (&mut self.0[usize::from(place) / 64], 1 << (place % 64));
        // Mostly it is set: not to write it again spares the next point from waiting for it.
        if *word & bit == 0 {
            *word |= bit;
        }
    }
}

impl Cells for Bits {
    const WANTS_OFFSETS: bool = false;

    fn of(voxels: &[(u16, Moments)]) -> Self {
        let mut bits = Self::default();
        voxels.iter().for_each(|&(place, _)| bits.set(place));
        bits
    }

    #[inline]
    fn add_points(&mut self, points: impl Iterator<Item = (u16, [u32; 3])>, _: u32) {
        points.for_each(|(place, _)| self.set(place));
    }

    fn add(&mut self, place: u16, _: &Moments) {
        self.set(place);
    }

    fn merge(&mut self, other: &Self) {
        self.0.iter_mut().zip(other.0).for_each(|(ours, theirs)| *ours |= theirs);
    }

    fn len(&self) -> usize {
        self.0.iter().map(|word| word.count_ones() as usize).sum()
    }

    fn each(&self, mut take: impl FnMut(u16, &Moments)) {
        for (first, word) in (0..).step_by(64).zip(self.0) {
            let mut left = word;
            while left != 0 {
                take(first + left.trailing_zeros() as u16, &Moments::default());
                left &= left - 1;
            }
        }
    }
}
