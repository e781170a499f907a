//! Numbers in text: lines of a range of a file, columns of a line, and decimals at the speed of the disk.

use std::ops::Range;

use memchr::{memchr, memchr_iter};
use wide::u8x16;

use super::Collector;
use super::decimals::{Shape, decimal, signed};
use super::input::Input;
use crate::Result;

/// Bytes of a part.
const PART_BYTES: u64 = 8 << 20;

/// Bytes that are read together.
const BLOCK: u64 = 256 * 1024;

/// A longer line is no row of numbers.
const LONGEST_LINE: usize = 64 * 1024;

/// Bytes of a line in which three usual numbers stand.
const WINDOW: usize = 64;

/// Zero bytes behind the last line, so that a window can be taken where its last byte is.
const PADDING: usize = WINDOW;

/// The lines that begin within a range of bytes, one after the other.
pub(super) struct Lines<'a> {
    input: &'a Input,
    buffer: Vec<u8>,
    /// Bytes of `buffer` that are the file's.
    filled: usize,
    /// Place of `buffer[0]` in the file.
    offset: u64,
    /// First byte of `buffer` not yet handed out.
    next: usize,
    /// Lines that begin here or later belong to the next range.
    end: u64,
}

/// A line without its end.
#[derive(Clone, Copy)]
pub(super) struct Line<'a> {
    /// Where it begins in the file.
    pub at: u64,
    /// The line and at least [`PADDING`] bytes more.
    padded: &'a [u8],
    length: usize,
}

impl<'a> Line<'a> {
    /// A line on its own.
    #[cfg(test)]
    fn new(padded: &'a [u8]) -> Self {
        Self { at: 0, padded, length: padded.len() - PADDING }
    }

    /// What stands in it.
    pub fn text(&self) -> &'a [u8] {
        &self.padded[..self.length]
    }
}

impl<'a> Lines<'a> {
    /// The lines that begin in `range`, whose start must begin a line.
    pub fn new(input: &'a Input, range: Range<u64>) -> Self {
        Self { input, buffer: vec![0; PADDING], filled: 0, offset: range.start, next: 0, end: range.end }
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

    /// Hand on lines as points as long as they begin as most do.
    #[inline(always)]
    fn take_usual(
        &mut self,
        columns: &Columns,
        shapes: &mut [Shape; 3],
        mut take: impl FnMut([f64; 3]) -> Result<()>,
    ) -> Result<()> {
        let held = &self.buffer[..self.filled];
        let limit = self.end.saturating_sub(self.offset).min(self.filled as u64) as usize;
        while self.next < limit {
            let Some(text) = self.buffer[self.next..].first_chunk() else { break };
            let Some((point, end)) = columns.parse_usual(text, shapes) else { break };
            let end = self.next + end;
            self.next = match held.get(end..) {
                Some([b'\n', ..]) => end + 1,
                Some([b'\r', b'\n', ..]) => end + 2,
                Some([b'\r', ..]) | None => break,
                Some(rest) => match newline(rest) {
                    Some(newline) => end + newline + 1,
                    None => break,
                },
            };
            take(point)?;
        }
        Ok(())
    }

    /// Where the next line begins.
    pub fn position(&self) -> u64 {
        self.offset + self.next as u64
    }

    /// The next line.
    #[inline(always)]
    pub fn next(&mut self) -> Result<Option<Line<'_>>> {
        let at = self.position();
        if at >= self.end {
            return Ok(None);
        }
        let (length, end) = loop {
            let rest = &self.buffer[self.next..self.filled];
            if let Some(length) = memchr(b'\n', rest) {
                break (length, length + 1);
            }
            if !self.fill()? {
                break (self.filled - self.next, self.filled - self.next);
            }
        };
        let padded = &self.buffer[self.next..];
        self.next += end;
        let length = if length > 0 && padded[length - 1] == b'\r' { length - 1 } else { length };
        Ok((end > 0).then_some(Line { at, padded, length }))
    }

    /// Read the next block behind what is left of this one. False at the end of the file.
    #[cold]
    fn fill(&mut self) -> Result<bool> {
        let left = self.filled - self.next;
        if left > LONGEST_LINE {
            let message = format!("expected lines of numbers, found a line of more than {LONGEST_LINE} bytes");
            return Err(self.input.bad(format!("{message} at byte {}", self.position())));
        }
        let read = self.offset + self.filled as u64;
        let more = BLOCK.min(self.input.len().saturating_sub(read)) as usize;
        self.buffer.copy_within(self.next..self.filled, 0);
        self.offset += self.next as u64;
        (self.next, self.filled) = (0, left + more);
        if self.buffer.len() < self.filled + PADDING {
            self.buffer.resize(self.filled + PADDING, 0);
        }
        self.input.read_at(read, &mut self.buffer[left..left + more])?;
        self.buffer[left + more..left + more + PADDING].fill(0);
        Ok(more > 0)
    }
}

/// Into how many parts of equal length to divide some bytes.
pub(super) fn byte_parts(all: Range<u64>) -> usize {
    (all.end - all.start).div_ceil(PART_BYTES).max(1) as usize
}

/// The bytes of one of them.
pub(super) fn byte_part(all: Range<u64>, part: usize) -> Range<u64> {
    let start = all.start + (part as u64).saturating_mul(PART_BYTES);
    start.min(all.end)..start.saturating_add(PART_BYTES).min(all.end)
}

/// The byte behind the next `count` lines from `start` on; `None` if the file ends before.
pub(super) fn skip_lines(input: &Input, start: u64, count: u64) -> Result<Option<u64>> {
    let (mut left, mut at, mut buffer) = (count, start, Vec::new());
    while left > 0 {
        if at == input.len() {
            // The last line may lack its end.
            let is_open = buffer.last().is_some_and(|&byte| byte != b'\n');
            return Ok((is_open && left == 1).then_some(at));
        }
        input.read_into(at, BLOCK.min(input.len() - at), &mut buffer)?;
        // Only the last line must be found; up to there counting will do, which is much faster.
        let newlines = memchr_iter(b'\n', &buffer).count() as u64;
        if newlines >= left {
            let last = memchr_iter(b'\n', &buffer).nth(left as usize - 1);
            return Ok(last.map(|last| at + last as u64 + 1));
        }
        left -= newlines;
        at += buffer.len() as u64;
    }
    Ok(Some(at))
}

/// The first end of a line, which is likely to be near.
#[inline(always)]
fn newline(text: &[u8]) -> Option<usize> {
    let near = |at| {
        let bytes = text.get(at..)?.first_chunk()?;
        let found = u8x16::new(*bytes).cmp_eq(u8x16::splat(b'\n')).move_mask();
        (found != 0).then(|| at + found.trailing_zeros() as usize)
    };
    near(0).or_else(|| near(16)).or_else(|| memchr(b'\n', text))
}

/// Where x, y, z are in a line, and what stands between the columns.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Columns {
    /// For each column up to the last one needed: the axis it gives, if any.
    axes: Vec<Option<u8>>,
    /// What each byte is.
    kinds: Box<[Kind; 256]>,
    /// Between columns; `None` for any number of blanks and tabs.
    pub delimiter: Option<u8>,
    /// Decimals as in 3,14.
    pub decimal_comma: bool,
    /// What stands before the decimals.
    point: u8,
    /// Whether x, y, z are the first columns, in this order.
    is_xyz: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    /// Part of a number or a word.
    Word,
    Blank,
    Delimiter,
}

impl Columns {
    /// x, y, z in the columns `xyz`.
    pub fn new(xyz: [usize; 3], delimiter: Option<u8>, decimal_comma: bool) -> Self {
        let mut axes = vec![None; xyz.iter().max().map_or(0, |last| last + 1)];
        for (axis, column) in xyz.into_iter().enumerate() {
            axes[column] = Some(axis as u8);
        }
        let mut kinds = Box::new([Kind::Word; 256]);
        for blank in *b" \t\"" {
            kinds[usize::from(blank)] = Kind::Blank;
        }
        if let Some(delimiter) = delimiter {
            kinds[usize::from(delimiter)] = Kind::Delimiter;
        }
        let point = if decimal_comma { b',' } else { b'.' };
        Self { axes, kinds, delimiter, decimal_comma, point, is_xyz: xyz == [0, 1, 2] }
    }

    /// The coordinates in a line that begins with x, y and z, plain decimals with one byte between them, and where they
    /// end; `None` for any other line, right or wrong. `shapes` are those of the line above, and become this line's.
    #[inline(always)]
    fn parse_usual(&self, text: &[u8; WINDOW], shapes: &mut [Shape; 3]) -> Option<([f64; 3], usize)> {
        let (mut point, mut at) = ([0.0; 3], 0);
        for axis in 0..3 {
            let text: &[u8; 17] = text.get(at..)?.first_chunk()?;
            let is_negative = text[0] == b'-';
            let text = text[usize::from(is_negative)..].first_chunk()?;
            let size = match shapes[axis].number(text) {
                Some(size) => size,
                None => {
                    shapes[axis] = self.shape(text, axis == 2)?;
                    shapes[axis].number(text)?
                }
            };
            point[axis] = signed(size, is_negative);
            at += usize::from(is_negative) + shapes[axis].length;
        }
        Some((point, at - 1))
    }

    /// The shape of a number, if what stands behind it may end it.
    #[cold]
    fn shape(&self, text: &[u8; 16], is_last: bool) -> Option<Shape> {
        let shape = Shape::of(text, self.point)?;
        let behind = text[shape.length - 1];
        let is_end = match self.kind(behind) {
            Kind::Delimiter => true,
            Kind::Blank => is_last || self.delimiter.is_none(),
            Kind::Word => is_last && matches!(behind, b'\r' | b'\n'),
        };
        is_end.then_some(shape)
    }

    /// The coordinates in any line; `None` if it has too few columns or words where numbers should be. An empty column
    /// is a number that is missing: NaN.
    #[inline]
    fn parse(&self, line: Line<'_>) -> Option<[f64; 3]> {
        let Line { padded: text, length, .. } = line;
        let mut point = [0.0; 3];
        let mut at = self.skip_blanks(text, 0);
        for (column, axis) in self.axes.iter().enumerate() {
            if column > 0 {
                match self.delimiter {
                    _ if at >= length => return None,
                    Some(delimiter) if text[at] == delimiter => at = self.skip_blanks(text, at + 1),
                    Some(_) => return None,
                    None => {}
                }
            }
            match axis {
                Some(axis) => {
                    let (value, end) = self.number(text, at, length)?;
                    point[usize::from(*axis)] = value;
                    at = end;
                    if at < length && self.kind(text[at]) == Kind::Word {
                        return None;
                    }
                }
                None => at = self.column_end(text, at, length),
            }
            at = self.skip_blanks(text, at);
        }
        Some(point)
    }

    /// The number at `at`, and where it ends.
    #[inline]
    fn number(&self, text: &[u8], at: usize, length: usize) -> Option<(f64, usize)> {
        match decimal(text, at, self.point) {
            None => self.unusual_number(text, at, length),
            found => found,
        }
    }

    /// With an exponent or very many digits, not finite, or missing.
    #[cold]
    fn unusual_number(&self, text: &[u8], at: usize, length: usize) -> Option<(f64, usize)> {
        let end = self.column_end(text, at, length);
        if end == at && self.delimiter.is_some() {
            return Some((f64::NAN, end));
        }
        let mut word = [0; 64];
        let word = word.get_mut(..end - at)?;
        word.copy_from_slice(&text[at..end]);
        if self.decimal_comma {
            word.iter_mut().filter(|byte| **byte == b',').for_each(|byte| *byte = b'.');
        }
        Some((fast_float2::parse(&*word).ok()?, end))
    }

    fn column_end(&self, text: &[u8], at: usize, length: usize) -> usize {
        let end = text[at.min(length)..length].iter().position(|&byte| self.kind(byte) != Kind::Word);
        end.map_or(length, |end| at + end)
    }

    #[inline]
    fn kind(&self, byte: u8) -> Kind {
        self.kinds[usize::from(byte)]
    }

    /// The line's end is no blank: this stops there.
    #[inline]
    fn skip_blanks(&self, text: &[u8], mut at: usize) -> usize {
        while self.kind(text[at]) == Kind::Blank {
            at += 1;
        }
        at
    }
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
    let mut shapes = [Shape::NONE; 3];
    loop {
        if columns.is_xyz {
            lines.take_usual(columns, &mut shapes, |point| convert(point, collector))?;
        }
        let Some(line) = lines.next()? else { return Ok(()) };
        match columns.parse(line) {
            Some(point) => convert(point, collector)?,
            None if line.text().trim_ascii().is_empty() || is_other(line.text()) => {}
            None => {
                let shown: String = String::from_utf8_lossy(line.text()).chars().take(60).collect();
                return Err(input.bad(format!("expected x, y, z at byte {}, found {shown:?}", line.at)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_the_nearest_doubles() {
        let mut state = 1u64;
        for i in 0..200_000u32 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let (whole, places) = (state >> (20 + i % 44), (state % 9) as usize);
            let value = whole as f64 / 10f64.powi(places as i32) * if i % 3 == 0 { -1.0 } else { 1.0 };
            let word = match i % 4 {
                0 => format!("{value:.places$}"),
                1 => format!("{value}"),
                2 => format!("{value:e}"),
                _ => format!("{value:.17}"),
            };
            let padded = format!("{word}\n");
            let line = Line { at: 0, padded: padded.as_bytes(), length: word.len() };
            let found = Columns::new([0, 0, 0], None, false).number(line.padded, 0, line.length);
            assert_eq!(found, Some((word.parse().unwrap(), word.len())), "{word}");
        }
    }

    #[test]
    fn usual_lines_are_read_as_any_other() {
        let (columns, mut shapes) = (Columns::new([0, 1, 2], None, false), [Shape::NONE; 3]);
        let (mut state, mut usual) = (1u64, 0);
        let mut random = |below: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % below
        };
        for _ in 0..200_000 {
            let mut text = String::new();
            for column in 0..3 + random(2) {
                let (longest, places) = (random(9) as u32, random(8) as usize);
                let (whole, part) = (random(10u64.pow(longest)), random(10u64.pow(places as u32)));
                let sign = ["", "-"][random(2) as usize];
                let point = if places > 0 || random(2) == 0 { "." } else { "" };
                let part = if places > 0 { format!("{part:0places$}") } else { String::new() };
                text += &format!("{}{sign}{whole}{point}{part}", if column > 0 { " " } else { "" });
            }
            if random(4) == 0 {
                let at = random(text.len() as u64) as usize;
                text.replace_range(at..=at, ["-", ".", " ", "e", "x", "\"", "7", ",", "\0"][random(9) as usize]);
            }
            let padded = format!("{text}\n9.9 9.9 9.9\n{}", "\0".repeat(PADDING));
            let line = Line { at: 0, padded: padded.as_bytes(), length: text.len() };
            let any = columns.parse(line);
            if let Some((found, end)) = columns.parse_usual(line.padded.first_chunk().unwrap(), &mut shapes) {
                assert_eq!(Some(found.map(f64::to_bits)), any.map(|point| point.map(f64::to_bits)), "{text}");
                assert!(end <= text.len() && columns.column_end(&line.padded[..end], 0, end) < end, "{text}");
                usual += 1;
            }
        }
        assert!(usual > 100_000, "{usual}");
    }

    #[test]
    fn columns_are_found_whatever_stands_between() {
        let parse = |xyz, delimiter, decimal_comma, text: &str| {
            let padded = format!("{text}{}", "\0".repeat(PADDING));
            Columns::new(xyz, delimiter, decimal_comma).parse(Line::new(padded.as_bytes()))
        };
        let point = Some([1.5, -2.0, 3e3]);
        assert_eq!(parse([0, 1, 2], None, false, "  1.5\t-2 3e3"), point);
        assert_eq!(parse([0, 1, 2], None, false, "1.5 -2 +3000.00 9 9"), point);
        assert_eq!(parse([3, 1, 0], Some(b','), false, "3000, -2.0 ,wall,1.5"), point);
        assert_eq!(parse([0, 1, 2], Some(b';'), true, "1,5;-2,0;3000"), point);
        assert_eq!(parse([0, 1, 2], Some(b','), false, "\"1.5\",\"-2\",\"3000\""), point);
        assert_eq!(parse([0, 1, 2], None, false, "1.5 -2"), None);
        assert_eq!(parse([0, 1, 2], None, false, "1.5 -2 x"), None);
        assert_eq!(parse([0, 1, 2], None, false, "1.5m -2 3"), None);
        assert_eq!(parse([0, 1, 2], None, false, ""), None);
        assert!(parse([0, 1, 2], Some(b','), false, "1.5,,3").is_some_and(|p| p[1].is_nan()));
    }
}
