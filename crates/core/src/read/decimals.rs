//! Plain decimals (sign, digits, point, digits; no exponent) that f64 arithmetic converts exactly: up to 15 digits over
//! a power of ten that a double holds exactly give the nearest double.

use wide::{f64x4, i16x8, u8x16};

/// Most digits.
const MOST: usize = 15;

/// Powers of ten by the number of their zeros.
const TENS: [f64; MOST + 1] = [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];

/// How the digits of a number stand. Most numbers are written as the one above them: what it takes to read them is kept,
/// so that they are read without looking for the point and the end.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    /// Bytes up to the one behind the number.
    pub length: usize,
    /// 255 for each byte of the length.
    within: u8x16,
    /// What stands at each byte of the length, as [`marks`] tells it.
    marks: u8x16,
    /// What each digit counts in its pair of bytes.
    weights: [i16x8; 2],
    /// What each pair counts.
    scales: [f64x4; 2],
    /// The power of ten by which the digits are too large.
    divisor: f64,
}

impl Shape {
    /// That of no number: no byte can be told apart by a mark and yet stand outside.
    pub const NONE: Self = Self {
        length: 0,
        within: u8x16::ZERO,
        marks: u8x16::ONE,
        weights: [i16x8::ZERO; 2],
        scales: [f64x4::ZERO; 2],
        divisor: 1.0,
    };

    /// The shape of the unsigned number at the start of some bytes and of the byte behind it. `None` unless it is a plain
    /// decimal that these bytes hold.
    #[cold]
    pub fn of(text: &[u8; 16], point: u8) -> Option<Self> {
        let end = text.iter().position(|&byte| !byte.is_ascii_digit() && byte != point)?;
        let (mut weights, mut scales, mut count, mut behind) = ([0; 16], [0.0; 8], 0, 0);
        for at in (0..end).rev() {
            if text[at] == point {
                behind = count;
                continue;
            }
            // The right one of two digits tells what the pair counts.
            let is_right = scales[at / 2] == 0.0;
            weights[at] = if is_right { 1 } else { 10 };
            if is_right {
                scales[at / 2] = TENS[count];
            }
            count += 1;
        }
        if count == 0 || end > count + 1 {
            return None;
        }
        let within = u8x16::new(std::array::from_fn(|at| if at <= end { 255 } else { 0 }));
        let [low, high] = [0, 8].map(|at| i16x8::new(std::array::from_fn(|i| weights[at + i])));
        Some(Self {
            length: end + 1,
            within,
            marks: marks(digits(text)) & within,
            weights: [low, high],
            scales: [0, 4].map(|at| f64x4::new(std::array::from_fn(|i| scales[at + i]))),
            divisor: TENS[behind],
        })
    }

    /// The number at the start of some bytes, if it and the byte behind it have this shape.
    #[inline(always)]
    pub fn number(&self, text: &[u8; 16]) -> Option<f64> {
        let digits = digits(text);
        if marks(digits) & self.within != self.marks {
            return None;
        }
        let mut sum = f64x4::from(i16x8::from_u8x16_low(digits).dot(self.weights[0])) * self.scales[0];
        if self.length > 8 {
            sum += f64x4::from(i16x8::from_u8x16_high(digits).dot(self.weights[1])) * self.scales[1];
        }
        Some(sum.reduce_add() / self.divisor)
    }
}

/// The values of digits; of all else more than nine.
#[inline(always)]
fn digits(text: &[u8; 16]) -> u8x16 {
    u8x16::new(*text) - u8x16::splat(b'0')
}

/// 0 for digits, and for all else what it is.
#[inline(always)]
fn marks(digits: u8x16) -> u8x16 {
    digits.saturating_sub(u8x16::splat(9))
}

/// The number at `start`, and where it ends. `None` if it is no plain decimal.
#[inline]
pub(super) fn decimal(text: &[u8], start: usize, point: u8) -> Option<(f64, usize)> {
    let is_negative = text[start] == b'-';
    let first = start + usize::from(is_negative);
    let (mut mantissa, mut at) = append_digits(text, first, 0);
    let (mut count, mut behind) = (at - first, 0);
    if text[at] == point {
        let dot = at;
        (mantissa, at) = append_digits(text, dot + 1, mantissa);
        behind = at - dot - 1;
        count += behind;
    }
    if count == 0 || count > MOST || matches!(text[at], b'e' | b'E' | b'd' | b'D') {
        return None;
    }
    Some((signed(mantissa as f64 / TENS[behind], is_negative), at))
}

/// `number` with the digits at `at` written behind it (overflowing if they are many), and where they end.
#[inline]
fn append_digits(text: &[u8], mut at: usize, mut number: i64) -> (i64, usize) {
    loop {
        let digit = text[at].wrapping_sub(b'0');
        if digit > 9 {
            return (number, at);
        }
        number = number.wrapping_mul(10).wrapping_add(i64::from(digit));
        at += 1;
    }
}

/// A sign is hard to guess: no branch.
#[inline]
pub(super) fn signed(size: f64, is_negative: bool) -> f64 {
    f64::from_bits(size.to_bits() ^ u64::from(is_negative) << 63)
}
