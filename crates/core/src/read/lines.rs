//! Numbers in text: lines of a range of a file, columns of a line, and decimals at the speed of the disk.

use std::ops::Range;

use memchr::{memchr, memchr_iter};

use super::input::Input;
use super::{Collector, PART};
use crate::Result;

/// Bytes that are read together.
const BLOCK: u64 = 256 * 1024;

/// A longer line is no row of numbers.
const LONGEST_LINE: usize = 64 * 1024;

/// The lines that begin within a range of bytes, one after the other.
pub(super) struct Lines<'a> {
    input: &'a Input,
    buffer: Vec<u8>,
    /// Place of `buffer[0]` in the file.
    offset: u64,
    /// First byte of `buffer` not yet handed out.
    next: usize,
    /// Lines that begin here or later belong to the next range.
    end: u64,
}

impl<'a> Lines<'a> {
    /// The lines that begin in `range`, whose start must begin a line.
    pub fn new(input: &'a Input, range: Range<u64>) -> Self {
        Self { input, buffer: Vec::new(), offset: range.start, next: 0, end: range.end }
    }

    /// The same, where `range.start` may lie within a line: that line belongs to the range before.
    pub fn within(input: &'a Input, range: Range<u64>, first: u64) -> Result<Self> {
        if range.start <= first {
            return Ok(Self::new(input, range));
        }
        let mut lines = Self::new(input, range.start - 1..range.end);
        lines.next()?;
        Ok(lines)
    }

    /// Where the next line begins.
    pub fn position(&self) -> u64 {
        self.offset + self.next as u64
    }

    /// The next line without its end, and where it begins.
    #[inline]
    pub fn next(&mut self) -> Result<Option<(u64, &[u8])>> {
        let begin = self.position();
        if begin >= self.end {
            return Ok(None);
        }
        loop {
            if let Some(length) = memchr(b'\n', &self.buffer[self.next..]) {
                let line = &self.buffer[self.next..self.next + length];
                self.next += length + 1;
                return Ok(Some((begin, line.strip_suffix(b"\r").unwrap_or(line))));
            }
            if !self.fill()? {
                let line = &self.buffer[self.next..];
                self.next = self.buffer.len();
                return Ok((!line.is_empty()).then_some((begin, line)));
            }
        }
    }

    /// Read the next block behind what is left of this one. False at the end of the file.
    fn fill(&mut self) -> Result<bool> {
        let left = self.buffer.len() - self.next;
        if left > LONGEST_LINE {
            let message = format!("expected lines of numbers, found a line of more than {LONGEST_LINE} bytes");
            return Err(self.input.bad(format!("{message} at byte {}", self.position())));
        }
        let read = self.offset + self.buffer.len() as u64;
        let more = BLOCK.min(self.input.len().saturating_sub(read)) as usize;
        self.offset += self.next as u64;
        self.buffer.copy_within(self.next.., 0);
        self.next = 0;
        self.buffer.resize(left + more, 0);
        self.input.read_at(read, &mut self.buffer[left..])?;
        Ok(more > 0)
    }
}

/// The byte ranges of the next `count` lines from `start` on, some [`PART`] lines each, and the byte behind them.
/// `None` if the file ends before.
pub(super) fn split_lines(input: &Input, start: u64, count: u64) -> Result<Option<(Vec<Range<u64>>, u64)>> {
    let (mut parts, mut first, mut seen, mut at) = (Vec::new(), start, 0, start);
    let mut buffer = Vec::new();
    while seen < count {
        if at == input.len() {
            // The last line may lack its end.
            let is_open = buffer.last().is_some_and(|&byte| byte != b'\n');
            if !is_open || seen + 1 < count {
                return Ok(None);
            }
            parts.push(first..at);
            return Ok(Some((parts, at)));
        }
        input.read_into(at, BLOCK.min(input.len() - at), &mut buffer)?;
        for newline in memchr_iter(b'\n', &buffer) {
            seen += 1;
            if seen % PART == 0 || seen == count {
                let end = at + newline as u64 + 1;
                parts.push(first..end);
                first = end;
            }
            if seen == count {
                return Ok(Some((parts, first)));
            }
        }
        at += buffer.len() as u64;
    }
    Ok(Some((parts, start)))
}

/// Where x, y, z are in a line, and what stands between the columns.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Columns {
    /// For each column up to the last one needed: the axis it gives, if any.
    axes: Vec<Option<u8>>,
    /// Between columns; `None` for any number of blanks and tabs.
    pub delimiter: Option<u8>,
    /// Decimals as in 3,14.
    pub decimal_comma: bool,
}

impl Columns {
    /// x, y, z in the columns `xyz`.
    pub fn new(xyz: [usize; 3], delimiter: Option<u8>, decimal_comma: bool) -> Self {
        let mut axes = vec![None; xyz.iter().max().map_or(0, |last| last + 1)];
        for (axis, column) in xyz.into_iter().enumerate() {
            axes[column] = Some(axis as u8);
        }
        Self { axes, delimiter, decimal_comma }
    }

    /// The coordinates in a line; `None` if it has too few columns or words where numbers should be. An empty column
    /// is a number that is missing: NaN.
    #[inline]
    pub fn parse(&self, line: &[u8]) -> Option<[f64; 3]> {
        let mut point = [0.0; 3];
        let mut rest = self.skip_blanks(line);
        for (column, axis) in self.axes.iter().enumerate() {
            if column > 0 {
                rest = match (self.delimiter, rest.first()) {
                    (_, None) => return None,
                    (Some(delimiter), Some(byte)) if *byte == delimiter => self.skip_blanks(&rest[1..]),
                    (Some(_), Some(_)) => return None,
                    (None, Some(_)) => rest,
                };
            }
            let length = match axis {
                Some(axis) => {
                    let (value, length) = self.number(rest)?;
                    point[usize::from(*axis)] = value;
                    length
                }
                None => rest.iter().position(|&byte| self.ends_column(byte)).unwrap_or(rest.len()),
            };
            let behind = &rest[length..];
            if axis.is_some() && behind.first().is_some_and(|&byte| !self.ends_column(byte)) {
                return None;
            }
            rest = self.skip_blanks(behind);
        }
        Some(point)
    }

    /// The number at the start of `text`, and its length.
    #[inline]
    fn number(&self, text: &[u8]) -> Option<(f64, usize)> {
        if let Some(found) = decimal(text, if self.decimal_comma { b',' } else { b'.' }) {
            return Some(found);
        }
        let length = text.iter().position(|&byte| self.ends_column(byte)).unwrap_or(text.len());
        if length == 0 && self.delimiter.is_some() {
            return Some((f64::NAN, 0));
        }
        let mut word = [0; 64];
        let word = word.get_mut(..length)?;
        word.copy_from_slice(&text[..length]);
        if self.decimal_comma {
            word.iter_mut().filter(|byte| **byte == b',').for_each(|byte| *byte = b'.');
        }
        Some((fast_float2::parse(&*word).ok()?, length))
    }

    #[inline]
    fn ends_column(&self, byte: u8) -> bool {
        self.delimiter == Some(byte) || self.is_blank(byte)
    }

    #[inline]
    fn is_blank(&self, byte: u8) -> bool {
        matches!(byte, b' ' | b'"' | b'\r') || (byte == b'\t' && self.delimiter != Some(b'\t'))
    }

    #[inline]
    fn skip_blanks<'a>(&self, mut text: &'a [u8]) -> &'a [u8] {
        while let [byte, rest @ ..] = text
            && self.is_blank(*byte)
        {
            text = rest;
        }
        text
    }
}

/// A plain decimal (sign, digits, point, digits; no exponent) that f64 arithmetic converts exactly: up to 15 digits
/// over a power of ten that a double holds exactly give the nearest double. `None` for everything else.
#[inline]
fn decimal(text: &[u8], point: u8) -> Option<(f64, usize)> {
    const POWERS: [f64; 16] = [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];
    let negative = text.first() == Some(&b'-');
    let start = usize::from(negative);
    let (mut mantissa, mut at) = (0u64, start);
    while let Some(digit) = text.get(at).map(|byte| byte.wrapping_sub(b'0')).filter(|digit| *digit < 10) {
        mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(digit));
        at += 1;
    }
    let (mut digits, mut behind) = (at - start, 0);
    if text.get(at) == Some(&point) {
        at += 1;
        let first = at;
        while let Some(digit) = text.get(at).map(|byte| byte.wrapping_sub(b'0')).filter(|digit| *digit < 10) {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(digit));
            at += 1;
        }
        behind = at - first;
        digits += behind;
    }
    if digits == 0 || digits > 15 || matches!(text.get(at), Some(b'e' | b'E' | b'd' | b'D')) {
        return None;
    }
    let value = mantissa as f64 / POWERS[behind];
    Some((if negative { -value } else { value }, at))
}

/// Hand on every line of a range as a point: the loop that all text formats share. `other` decides what a line that
/// is no point means.
pub(super) fn read_points(
    input: &Input,
    mut lines: Lines<'_>,
    columns: &Columns,
    collector: &mut Collector<'_>,
    mut convert: impl FnMut([f64; 3], &mut Collector<'_>) -> Result<()>,
    is_other: impl Fn(&[u8]) -> bool,
) -> Result<()> {
    while let Some((at, line)) = lines.next()? {
        match columns.parse(line) {
            Some(point) => convert(point, collector)?,
            None if line.trim_ascii().is_empty() || is_other(line) => {}
            None => {
                let shown: String = String::from_utf8_lossy(line).chars().take(60).collect();
                return Err(input.bad(format!("expected x, y, z at byte {at}, found {shown:?}")));
            }
        }
    }
    Ok(())
}
