//! Bricks: 8 x 8 x 8 voxels that lie together, and what is kept of the points in each.

/// Side of a brick as a power of two.
pub(crate) const SIDE_BITS: u32 = 3;
/// Voxels along the side of a brick.
pub const SIDE: i32 = 1 << SIDE_BITS;
/// Voxels of a brick.
pub(crate) const BRICK_VOXELS: usize = 1 << (3 * SIDE_BITS);
/// Up to this many voxels a brick is searched through; with more it gets a table of its slots.
const SEARCHED_VOXELS: usize = 8;

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
    #[inline]
    fn add_point(&mut self, offset: [u32; 3]) {
        let [x, y, z] = offset.map(u64::from);
        self.count += 1;
        for (sum, value) in self.sum.iter_mut().zip([x, y, z]) {
            *sum += value;
        }
        for (sum, value) in self.products.iter_mut().zip([x * x, x * y, y * y]) {
            *sum += value;
        }
    }

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
    /// One more point, at `offset` from the lower corner of its voxel, in quanta.
    fn add_point(&mut self, place: u16, offset: [u32; 3]);
    /// All that is summed up in `moments`.
    fn add(&mut self, place: u16, moments: &Moments);
    /// All that another brick holds.
    fn merge(&mut self, other: &Self);
    /// Number of occupied voxels.
    fn len(&self) -> usize;
    /// Hand on the occupied voxels, in the order of their places.
    fn each(&self, take: impl FnMut(u16, &Moments));
}

/// A voxel in which there are points.
///
/// Sums come first and start at whole 16 bytes: two at a time they are added up without ever lying in two cache lines.
#[derive(Debug, Clone)]
#[repr(C, align(16))]
struct Occupied {
    moments: Moments,
    place: u16,
}

/// Sums for each occupied voxel; only these take room.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sums {
    /// In order of arrival.
    voxels: Vec<Occupied>,
    /// Where each place stands in `voxels`, plus one; made once one is looked up among more than a few.
    slots: Option<Box<[u16; BRICK_VOXELS]>>,
}

impl Sums {
    #[inline]
    fn voxel(&mut self, place: u16) -> &mut Moments {
        if self.slots.is_none() && self.voxels.len() > SEARCHED_VOXELS {
            self.make_slots();
        }
        let slot = match &self.slots {
            Some(slots) => usize::from(slots[usize::from(place)]),
            None => self.voxels.iter().position(|voxel| voxel.place == place).map_or(0, |i| i + 1),
        };
        let index = if slot > 0 { slot - 1 } else { self.insert(place) };
        &mut self.voxels[index].moments
    }

    #[cold]
    fn insert(&mut self, place: u16) -> usize {
        if self.voxels.is_empty() {
            self.voxels.reserve_exact(1); // a stray has a brick of its own and stays alone there
        }
        self.voxels.push(Occupied { moments: Moments::default(), place });
        if let Some(slots) = &mut self.slots {
            slots[usize::from(place)] = self.voxels.len() as u16;
        }
        self.voxels.len() - 1
    }

    #[cold]
    fn make_slots(&mut self) {
        let mut slots = Box::new([0; BRICK_VOXELS]);
        for (slot, voxel) in (1..).zip(&self.voxels) {
            slots[usize::from(voxel.place)] = slot;
        }
        self.slots = Some(slots);
    }
}

impl Cells for Sums {
    const WANTS_OFFSETS: bool = true;

    fn of(voxels: &[(u16, Moments)]) -> Self {
        let voxels = voxels.iter().map(|&(place, moments)| Occupied { moments, place }).collect();
        Self { voxels, slots: None }
    }

    #[inline]
    fn add_point(&mut self, place: u16, offset: [u32; 3]) {
        self.voxel(place).add_point(offset);
    }

    fn add(&mut self, place: u16, moments: &Moments) {
        self.voxel(place).add(moments);
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
            occupied.add_point(voxel.place, [0; 3]);
            slots[usize::from(voxel.place)] = slot;
        }
        occupied.each(|place, _| take(place, &self.voxels[usize::from(slots[usize::from(place)])].moments));
    }
}

/// One bit for each voxel.
#[derive(Debug, Clone, Default)]
pub(crate) struct Bits([u64; BRICK_VOXELS / 64]);

impl Cells for Bits {
    const WANTS_OFFSETS: bool = false;

    fn of(voxels: &[(u16, Moments)]) -> Self {
        let mut bits = Self::default();
        voxels.iter().for_each(|&(place, _)| bits.add_point(place, [0; 3]));
        bits
    }

    #[inline]
    fn add_point(&mut self, place: u16, _: [u32; 3]) {
        let (word, bit) = (&mut self.0[usize::from(place) / 64], 1 << (place % 64));
        // Mostly it is set: not to write it again spares the next point from waiting for it.
        if *word & bit == 0 {
            *word |= bit;
        }
    }

    fn add(&mut self, place: u16, _: &Moments) {
        self.add_point(place, [0; 3]);
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
