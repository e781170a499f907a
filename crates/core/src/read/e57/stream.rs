//! The byte stream of one field: values of any number of bits, one after the other.

use e57::RecordDataType;

use super::super::input::{f64_at, u32_at, u64_at};

/// Zero bytes behind a stream's bytes, so that eight or sixteen can be taken at once anywhere.
const PADDING: usize = 16;

/// One field of the records.
pub(super) struct Field {
    /// Which byte stream of a packet carries it.
    pub stream: usize,
    /// Bits of a value; none if all values are the same.
    pub bits: u32,
    kind: Kind,
}

enum Kind {
    Single,
    Double,
    /// (raw + least) x scale + offset
    Integer {
        least: i64,
        scale: f64,
        offset: f64,
    },
}

impl Field {
    pub fn new(stream: usize, data_type: &RecordDataType) -> Self {
        let width = |min: i64, max: i64| 128 - (i128::from(max) - i128::from(min)).max(0).leading_zeros();
        let (bits, kind) = match *data_type {
            RecordDataType::Single { .. } => (32, Kind::Single),
            RecordDataType::Double { .. } => (64, Kind::Double),
            RecordDataType::ScaledInteger { min, max, scale, offset } => {
                (width(min, max), Kind::Integer { least: min, scale, offset })
            }
            RecordDataType::Integer { min, max } => {
                (width(min, max), Kind::Integer { least: min, scale: 1.0, offset: 0.0 })
            }
        };
        Self { stream, bits, kind }
    }
}

/// The part of a field's byte stream that waits to be unpacked.
pub(super) struct Stream<'a> {
    field: &'a Field,
    /// Byte of the whole stream that must come next.
    pub next_byte: u64,
    bytes: Vec<u8>,
    /// Bits of `bytes` already unpacked.
    bit: u64,
    pub values: Vec<f64>,
}

impl<'a> Stream<'a> {
    /// Wait for record `first`.
    pub fn new(field: &'a Field, first: u64) -> Self {
        let bit = first * u64::from(field.bits);
        Self { field, next_byte: bit / 8, bytes: vec![0; PADDING], bit: bit % 8, values: Vec::new() }
    }

    /// Take over the piece that begins at byte `before` of the whole stream, or what is new in it.
    pub fn append(&mut self, piece: &[u8], before: u64) {
        let known = usize::try_from(self.next_byte.saturating_sub(before)).unwrap_or(usize::MAX).min(piece.len());
        let done = (self.bit / 8) as usize;
        self.bit %= 8;
        self.bytes.truncate(self.bytes.len() - PADDING);
        self.bytes.drain(..done);
        self.bytes.extend_from_slice(&piece[known..]);
        self.bytes.extend_from_slice(&[0; PADDING]);
        self.next_byte += (piece.len() - known) as u64;
    }

    /// Whole values that wait.
    pub fn available(&self) -> u64 {
        let bits = (self.bytes.len() - PADDING) as u64 * 8 - self.bit;
        bits.checked_div(u64::from(self.field.bits)).unwrap_or(u64::MAX)
    }

    /// Unpack `count` values, which are available.
    pub fn unpack(&mut self, count: usize) {
        self.values.clear();
        let start = (self.bit / 8) as usize;
        match self.field.kind {
            Kind::Single => {
                let values = self.bytes[start..start + 4 * count].chunks_exact(4);
                self.values.extend(values.map(|v| f64::from(f32::from_bits(u32_at(v, 0)))));
            }
            Kind::Double => {
                let values = self.bytes[start..start + 8 * count].chunks_exact(8);
                self.values.extend(values.map(|v| f64_at(v, 0)));
            }
            Kind::Integer { least, scale, offset } => {
                let (bits, mut bit) = (self.field.bits, self.bit);
                let mask = if bits == 64 { u64::MAX } else { (1 << bits) - 1 };
                let value = |raw: u64| (raw & mask).wrapping_add_signed(least) as i64 as f64 * scale + offset;
                let mut next = || {
                    let (byte, shift) = ((bit / 8) as usize, bit % 8);
                    bit += u64::from(bits);
                    (byte, shift)
                };
                if bits <= 57 {
                    self.values.extend((0..count).map(|_| {
                        let (byte, shift) = next();
                        value(u64_at(&self.bytes, byte) >> shift)
                    }));
                } else {
                    self.values.extend((0..count).map(|_| {
                        let (byte, shift) = next();
                        let high = u128::from(u64_at(&self.bytes, byte + 8));
                        value(((high << 64 | u128::from(u64_at(&self.bytes, byte))) >> shift) as u64)
                    }));
                }
            }
        }
        self.bit += count as u64 * u64::from(self.field.bits);
    }
}
