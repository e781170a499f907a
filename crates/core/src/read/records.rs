//! Binary records of equal length, each with x, y, z somewhere in it: what PLY and PCD have in common.

use super::input::{Input, array};
use super::{BATCH, Collector, PART, READ};
use crate::Result;

/// A type of number in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Scalar {
    /// Bytes of a value.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The value in the first bytes.
    #[inline]
    pub fn value(self, bytes: &[u8], is_big_endian: bool) -> f64 {
        macro_rules! number {
            ($t:ty) => {{
                let raw = array(bytes, 0);
                (if is_big_endian { <$t>::from_be_bytes(raw) } else { <$t>::from_le_bytes(raw) }) as f64
            }};
        }
        match self {
            Self::I8 => number!(i8),
            Self::U8 => number!(u8),
            Self::I16 => number!(i16),
            Self::U16 => number!(u16),
            Self::I32 => number!(i32),
            Self::U32 => number!(u32),
            Self::I64 => number!(i64),
            Self::U64 => number!(u64),
            Self::F32 => number!(f32),
            Self::F64 => number!(f64),
        }
    }
}

/// Where the records are and where in each of them the coordinates.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Records {
    /// Byte of the file at which the first one begins.
    pub start: u64,
    pub count: u64,
    /// Bytes of a record.
    pub length: usize,
    /// Byte within the record and type of x, y, z.
    pub axes: [(usize, Scalar); 3],
    pub is_big_endian: bool,
}

impl Records {
    /// Parts that can be read side by side.
    pub fn parts(&self) -> usize {
        self.count.div_ceil(PART).max(1) as usize
    }

    /// Complain if the file cannot hold the records.
    pub fn check(&self, input: &Input) -> Result<()> {
        let held = input.len().saturating_sub(self.start) / self.length as u64;
        if held < self.count {
            let message = format!("the header promises {} points, the file holds {held}; it is cut short", self.count);
            return Err(input.bad(message));
        }
        Ok(())
    }

    /// Hand on the points of a part.
    pub fn read(&self, input: &Input, part: usize, collector: &mut Collector<'_>) -> Result<()> {
        let end = ((part as u64 + 1) * PART).min(self.count);
        let mut buffer = Vec::new();
        for first in (part as u64 * PART..end).step_by(READ) {
            let count = (end - first).min(READ as u64);
            input.read_into(self.start + first * self.length as u64, count * self.length as u64, &mut buffer)?;
            buffer.chunks(self.length * BATCH).try_for_each(|records| self.decode(records, collector))?;
        }
        Ok(())
    }

    /// Hand on the points of whole records. The usual types get a loop of their own.
    fn decode(&self, records: &[u8], collector: &mut Collector<'_>) -> Result<()> {
        let x = self.axes[0].0;
        match (self.axes.map(|(_, scalar)| scalar), self.is_big_endian) {
            ([Scalar::F32, Scalar::F32, Scalar::F32], false) if self.axes.map(|(at, _)| at) == [x, x + 4, x + 8] => {
                let points = records.chunks_exact(self.length).map(|record| {
                    let raw: [u8; 12] = array(record, x); // its length is checked once
                    [0, 4, 8].map(|at| f64::from(f32::from_le_bytes(array(&raw, at))))
                });
                collector.extend(points, std::iter::empty())
            }
            ([Scalar::F32, Scalar::F32, Scalar::F32], false) => {
                self.decode_by(records, collector, |bytes, _| Scalar::F32.value(bytes, false))
            }
            ([Scalar::F64, Scalar::F64, Scalar::F64], false) => {
                self.decode_by(records, collector, |bytes, _| Scalar::F64.value(bytes, false))
            }
            (_, is_big_endian) => {
                self.decode_by(records, collector, |bytes, scalar| scalar.value(bytes, is_big_endian))
            }
        }
    }

    #[inline]
    fn decode_by(
        &self,
        records: &[u8],
        collector: &mut Collector<'_>,
        value: impl Fn(&[u8], Scalar) -> f64,
    ) -> Result<()> {
        let points = records.chunks_exact(self.length);
        let points = points.map(|record| self.axes.map(|(at, scalar)| value(&record[at..], scalar)));
        collector.extend(points, std::iter::empty())
    }
}
