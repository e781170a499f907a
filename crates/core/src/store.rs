//! Evidence files. What a reader of another program needs is in `docs/evidence_files.md`; in short:
//!
//! | bytes | what |
//! |---|---|
//! | 16 | `asbuilt evidence` |
//! | 4 | version of the format, u32, little-endian |
//! | ... | the evidence, its numbers as LEB128 (seven bits a byte, the lowest first) |
//! | 4 | CRC-32C of all bytes before, u32, little-endian |
//!
//! Scans, bricks and voxels are written in order, so that the same evidence is the same bytes, however it was gathered.
//! There is no compression to unpack: what a file claims to hold it must hold, and memory stays in proportion to its
//! size.

use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use crate::brick::{BRICK_VOXELS, Cells, Moments, SIDE_BITS};
use crate::voxel::{Brick, Bricks, Evidence, Kept, ScanEvidence, Slab, Space, VOXEL_QUANTA, Voxel, with_bricks};
use crate::{Error, Result};

/// The first bytes of every evidence file.
pub const MAGIC: &[u8; 16] = b"asbuilt evidence";
/// Version of the format that is written, and the newest that is read.
pub const VERSION: u32 = 1;

const HEAD: usize = MAGIC.len() + 4;
const CHECKSUM: usize = 4;
/// Bytes of the longest number.
const LONGEST: usize = 10;
const CUT_SHORT: &str = "its checksum is wrong; the file is damaged or cut short";

/// What an evidence file says before its voxels.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Side of a voxel, m.
    pub voxel: f64,
    /// What is kept of the points in a voxel.
    pub kept: Kept,
    /// Points that came in.
    pub points: u64,
    /// Whatever its writer had to say: inputs, coordinate system.
    pub about: String,
    /// Sorted by key.
    pub scans: Vec<ScanEvidence>,
}

/// Write an evidence file. It appears under its name when it is whole, and replaces what was there.
///
/// # Errors
/// [`Error::Io`] if it cannot be written.
pub fn save(evidence: &Evidence, about: &str, path: &Path) -> Result<()> {
    let mut unfinished = path.as_os_str().to_owned();
    unfinished.push(".unfinished");
    let unfinished = PathBuf::from(unfinished);
    let written = File::create(&unfinished).and_then(|file| {
        let mut out = BufWriter::with_capacity(1 << 18, file);
        write(evidence, about, &mut out)?;
        out.into_inner()?.sync_all()?;
        std::fs::rename(&unfinished, path)
    });
    written.map_err(|error| {
        let _ = std::fs::remove_file(&unfinished);
        Error::io(path, error)
    })
}

/// The bytes of an evidence file whose checksum is right: its voxels can be had without the bricks that they merge in.
#[derive(Debug)]
pub struct Stored {
    name: PathBuf,
    bytes: Vec<u8>,
    /// Where the bricks begin.
    bricks: usize,
    quanta: u32,
    /// What it says before its voxels.
    pub summary: Summary,
}

impl Stored {
    /// Read a file.
    ///
    /// # Errors
    /// [`Error::BadFile`] if it is no evidence, or damaged; [`Error::Unsupported`] if it is of a newer version.
    pub fn open(path: &Path) -> Result<Self> {
        // Of what is no evidence, be it long, no more than its head.
        let mut head = Vec::new();
        let mut file = File::open(path).map_err(|e| Error::io(path, e))?;
        Read::by_ref(&mut file).take(HEAD as u64).read_to_end(&mut head).map_err(|e| Error::io(path, e))?;
        check_head(&head).map_err(|error| error.of(path))?;
        file.read_to_end(&mut head).map_err(|e| Error::io(path, e))?;
        Self::of(head, path)
    }

    /// The bytes of a file; messages call them `name`.
    ///
    /// # Errors
    /// As [`Stored::open`].
    pub fn of(bytes: Vec<u8>, name: &Path) -> Result<Self> {
        let of_file = |error: Wrong| error.of(name);
        check_head(&bytes[..bytes.len().min(HEAD)]).map_err(of_file)?;
        let Some((content, checksum)) =
            bytes.split_last_chunk::<CHECKSUM>().filter(|(content, _)| content.len() >= HEAD)
        else {
            return Err(Error::bad_file(name, CUT_SHORT));
        };
        if crc32c::crc32c(content).to_le_bytes() != *checksum {
            return Err(Error::bad_file(name, CUT_SHORT));
        }
        let mut reader = Reader::new(content);
        reader.head().map_err(of_file)?;
        let (quanta, summary) = reader.summary().map_err(of_file)?;
        let bricks = content.len() - reader.left as usize;
        Ok(Self { name: name.to_owned(), bricks, quanta, summary, bytes })
    }

    /// The evidence.
    ///
    /// # Errors
    /// As [`Stored::open`].
    pub fn evidence(&self) -> Result<Evidence> {
        let mut evidence = Evidence::with_quanta(self.quanta, self.summary.kept);
        for scan in &self.summary.scans {
            let index = evidence.scan(&scan.key, scan.position);
            evidence.count(scan.points, index);
        }
        with_bricks!(&mut evidence.space, bricks => self.each_brick(|key, scans, voxels| {
            bricks.insert(key, Brick { cells: Cells::of(voxels), scans: scans.to_vec() });
        })?);
        Ok(evidence)
    }

    /// Hand on the occupied voxels, sorted by index, as [`Evidence::each_voxel`] does.
    ///
    /// # Errors
    /// As [`Stored::open`]; some may have been handed on.
    pub fn each_voxel(&self, mut take: impl FnMut(Voxel)) -> Result<()> {
        let mut slab = Slab::default();
        self.each_brick(|key, _, voxels| slab.add(key, &mut take, |added| added.extend_from_slice(voxels)))?;
        slab.hand_on(&mut take);
        Ok(())
    }

    /// There are no more voxels than this, and hardly fewer.
    pub fn most_voxels(&self) -> usize {
        let numbers = self.bytes[self.bricks..].iter().filter(|&&byte| byte < 0x80).count();
        numbers / if self.summary.kept == Kept::Moments { 8 } else { 1 }
    }

    /// Hand on the bricks, in order: index, scans, and place and sums of each voxel. Nothing but the checksum is believed.
    fn each_brick(&self, take: impl FnMut([i32; 3], &[u32], &[(u16, Moments)])) -> Result<()> {
        let mut reader = Reader::new(&self.bytes[self.bricks..self.bytes.len() - CHECKSUM]);
        let scans = self.summary.scans.len() as u32;
        let wrong = match reader.bricks(scans, self.quanta, self.summary.kept, take) {
            Ok(counted) if self.summary.kept == Kept::Moments && counted != self.summary.points => {
                Wrong::data("as many points in the voxels as in the scans")
            }
            Ok(_) if reader.left > 0 => Wrong::data("nothing behind the last voxel"),
            Ok(_) => return Ok(()),
            Err(wrong) => wrong,
        };
        Err(wrong.of(&self.name))
    }
}

/// What an evidence file says before its voxels. Its checksum is not looked at.
///
/// # Errors
/// As [`Stored::open`].
pub fn summary(path: &Path) -> Result<Summary> {
    let file = File::open(path).map_err(|e| Error::io(path, e))?;
    let length = file.metadata().map_err(|e| Error::io(path, e))?.len();
    let left = length.saturating_sub(CHECKSUM as u64);
    let mut reader = Reader { inner: BufReader::new(file), left };
    let found = reader.head().and_then(|()| reader.summary());
    found.map(|(_, summary)| summary).map_err(|error| error.of(path))
}

/// The bytes of an evidence file.
pub fn to_bytes(evidence: &Evidence, about: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(evidence, about, &mut bytes).expect("memory takes all");
    bytes
}

/// Whether these are the first bytes of an evidence file.
pub fn is_evidence(head: &[u8]) -> bool {
    head.starts_with(MAGIC)
}

fn write(evidence: &Evidence, about: &str, out: &mut impl Write) -> io::Result<()> {
    let mut writer = Writer { out, checksum: 0 };
    writer.bytes(MAGIC)?;
    writer.bytes(&VERSION.to_le_bytes())?;
    writer.number(u64::from(evidence.quanta()))?;
    writer.number(match evidence.kept() {
        Kept::Moments => 0,
        Kept::Occupancy => 1,
    })?;
    writer.text(about)?;
    let scans = evidence.scans();
    writer.number(scans.len() as u64)?;
    for scan in scans {
        writer.text(&scan.key)?;
        writer.number(scan.points)?;
        writer.number(u64::from(scan.position.is_some()))?;
        for value in scan.position.iter().flatten() {
            writer.bytes(&value.to_le_bytes())?;
        }
    }
    let ranks = evidence.scan_ranks();
    with_bricks!(&evidence.space, bricks => writer.bricks(bricks, &ranks, evidence.kept())?);
    let checksum = writer.checksum;
    out.write_all(&checksum.to_le_bytes())
}

struct Writer<'a, W> {
    out: &'a mut W,
    checksum: u32,
}

impl<W: Write> Writer<'_, W> {
    fn bytes(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.checksum = crc32c::crc32c_append(self.checksum, bytes);
        self.out.write_all(bytes)
    }

    fn number(&mut self, number: u64) -> io::Result<()> {
        let (bytes, length) = encode(number);
        self.bytes(&bytes[..length])
    }

    fn text(&mut self, text: &str) -> io::Result<()> {
        self.number(text.len() as u64)?;
        self.bytes(text.as_bytes())
    }

    /// Sorted by index: the step from the one before, its scans, its voxels.
    fn bricks<C: Cells>(&mut self, bricks: &Bricks<C>, ranks: &[u32], kept: Kept) -> io::Result<()> {
        let mut bricks: Vec<_> = bricks.iter().collect();
        bricks.sort_unstable_by_key(|(key, _)| **key);
        self.number(bricks.len() as u64)?;
        let (mut before, mut bytes, mut scans) = ([0; 3], Bytes::default(), Vec::new());
        for (&key, brick) in bricks {
            bytes.length = 0;
            for axis in 0..3 {
                let step = i64::from(key[axis]) - i64::from(before[axis]);
                bytes.push([(step << 1 ^ step >> 63) as u64]); // zigzag: 0, -1, 1, -2...
            }
            before = key;
            scans.clear();
            scans.extend(brick.scans.iter().map(|&scan| ranks[scan as usize]));
            scans.sort_unstable();
            bytes.push([scans.len() as u64]);
            let mut next = 0;
            for &scan in &scans {
                bytes.push([u64::from(scan - next)]);
                next = scan + 1;
            }
            bytes.push([brick.cells.len() as u64 - 1]); // a brick without voxels is none
            let mut next = 0;
            brick.cells.each(|place, moments| {
                let step = u64::from(place - next);
                next = place + 1;
                if kept == Kept::Moments {
                    let Moments { count, sum: [x, y, z], products: [xx, xy, yy] } = *moments;
                    bytes.push([step, count, x, y, z, xx, xy, yy]);
                } else {
                    bytes.push([step]);
                }
            });
            self.bytes(bytes.written())?;
        }
        Ok(())
    }
}

/// Numbers as they are written. There is always room for the longest, so that short ones are copied with it.
#[derive(Default)]
struct Bytes {
    buffer: Vec<u8>,
    length: usize,
}

impl Bytes {
    #[inline]
    fn push<const N: usize>(&mut self, numbers: [u64; N]) {
        let end = self.length + N * LONGEST;
        if self.buffer.len() < end {
            self.buffer.resize(2 * end, 0);
        }
        for number in numbers {
            let (encoded, length) = encode(number);
            self.buffer[self.length..self.length + LONGEST].copy_from_slice(&encoded);
            self.length += length;
        }
    }

    fn written(&self) -> &[u8] {
        &self.buffer[..self.length]
    }
}

/// The bytes of a number, and how many of them there are.
#[inline]
fn encode(number: u64) -> ([u8; LONGEST], usize) {
    let length = (63 - (number | 1).leading_zeros() as usize) / 7 + 1;
    let mut bytes = [0; LONGEST];
    if length <= 8 {
        // Nearly all are short: seven bits each go to the bytes of one word.
        let word = (number & 0x0fff_ffff) | (number & 0x00ff_ffff_f000_0000) << 4;
        let word = (word & 0x0000_3fff_0000_3fff) | (word & 0x0fff_c000_0fff_c000) << 2;
        let word = (word & 0x007f_007f_007f_007f) | (word & 0x3f80_3f80_3f80_3f80) << 1;
        let others = (1 << (8 * (length - 1))) - 1;
        bytes[..8].copy_from_slice(&(word | (others & 0x8080_8080_8080_8080)).to_le_bytes());
    } else {
        for (i, byte) in bytes[..length].iter_mut().enumerate() {
            *byte = (number >> (7 * i)) as u8 | if i + 1 < length { 0x80 } else { 0 };
        }
    }
    (bytes, length)
}

/// The number at the front of some bytes, and how many of them it takes; None if it is none of at most 64 bits.
#[inline]
fn decode(bytes: &[u8; LONGEST]) -> Option<(u64, usize)> {
    // Nearly all are short: their bytes lie in one word, of which seven bits each are put together.
    let [low @ .., _, _] = bytes;
    let word = u64::from_le_bytes(*low);
    let ends = !word & 0x8080_8080_8080_8080;
    if ends != 0 {
        let taken = ends.trailing_zeros() as usize / 8 + 1;
        let word = word & (ends ^ (ends - 1)) & 0x7f7f_7f7f_7f7f_7f7f;
        let word = (word & 0x007f_007f_007f_007f) | (word & 0x7f00_7f00_7f00_7f00) >> 1;
        let word = (word & 0x0000_3fff_0000_3fff) | (word & 0x3fff_0000_3fff_0000) >> 2;
        let word = (word & 0x0000_0000_0fff_ffff) | (word & 0x0fff_ffff_0000_0000) >> 4;
        // A last byte of zero would be a second way to write the same number.
        return (taken == 1 || bytes[taken - 1] != 0).then_some((word, taken));
    }
    let mut number = 0;
    for (i, &byte) in bytes.iter().enumerate() {
        let (bits, shift) = (u64::from(byte & 0x7f), 7 * i);
        // Ten bytes hold 70 bits.
        if bits << shift >> shift != bits || (byte == 0 && i > 0) {
            break;
        }
        number |= bits << shift;
        if byte < 0x80 {
            return Some((number, i + 1));
        }
    }
    None
}

fn check_head(head: &[u8]) -> std::result::Result<(), Wrong> {
    if !is_evidence(head) || head.len() < HEAD {
        return Err(Wrong::Data("expected an evidence file (first bytes: asbuilt evidence), found other data".into()));
    }
    let version = u32::from_le_bytes([head[16], head[17], head[18], head[19]]);
    match version {
        VERSION => Ok(()),
        0 => Err(Wrong::data("a version of 1 or more")),
        _ => Err(Wrong::Version(version)),
    }
}

fn no_number() -> Wrong {
    Wrong::data("a number of at most 64 bits")
}

/// What is wrong with a file.
enum Wrong {
    /// The message.
    Data(String),
    Version(u32),
    Io(io::Error),
}

impl Wrong {
    fn data(expected: &str) -> Self {
        Self::Data(format!("expected {expected}; the evidence file is damaged"))
    }

    fn of(self, path: &Path) -> Error {
        match self {
            Self::Data(message) => Error::bad_file(path, message),
            Self::Version(version) => Error::unsupported(
                path,
                format!("expected an evidence file of version {VERSION}, found {version}; it needs a newer asbuilt"),
            ),
            Self::Io(error) => Error::io(path, error),
        }
    }
}

/// Takes numbers from a file of known length.
struct Reader<R> {
    inner: R,
    left: u64,
}

impl<'a> Reader<&'a [u8]> {
    fn new(bytes: &'a [u8]) -> Self {
        Self { inner: bytes, left: bytes.len() as u64 }
    }
}

impl<R: BufRead> Reader<R> {
    fn bytes<const N: usize>(&mut self) -> std::result::Result<[u8; N], Wrong> {
        let mut bytes = [0; N];
        self.left = self.left.checked_sub(N as u64).ok_or_else(|| Wrong::Data(CUT_SHORT.into()))?;
        self.inner.read_exact(&mut bytes).map_err(Wrong::Io)?;
        Ok(bytes)
    }

    fn head(&mut self) -> std::result::Result<(), Wrong> {
        let mut head = Vec::new();
        let read = self.inner.by_ref().take(HEAD as u64).read_to_end(&mut head).map_err(Wrong::Io)?;
        self.left = self.left.saturating_sub(read as u64);
        check_head(&head)
    }

    #[inline]
    fn number(&mut self) -> std::result::Result<u64, Wrong> {
        self.numbers().map(|[number]| number)
    }

    #[inline]
    fn numbers<const N: usize>(&mut self) -> std::result::Result<[u64; N], Wrong> {
        let block = self.inner.fill_buf().map_err(Wrong::Io)?;
        let (mut numbers, mut taken) = ([0; N], 0);
        let is_ready = block.len().min(self.left as usize) >= N * LONGEST;
        for number in &mut numbers {
            let ready = block.get(taken..).and_then(|rest| rest.first_chunk()).filter(|_| is_ready);
            let Some(found) = ready.map(decode) else { return self.numbers_at_end() };
            let (value, length) = found.ok_or_else(no_number)?;
            (*number, taken) = (value, taken + length);
        }
        self.inner.consume(taken);
        self.left -= taken as u64;
        Ok(numbers)
    }

    /// Numbers byte by byte, where the buffer or the file may end.
    #[cold]
    fn numbers_at_end<const N: usize>(&mut self) -> std::result::Result<[u64; N], Wrong> {
        let mut numbers = [0; N];
        for number in &mut numbers {
            let mut bytes = [0; LONGEST];
            for byte in &mut bytes {
                [*byte] = self.bytes()?;
                if *byte < 0x80 {
                    break;
                }
            }
            (*number, _) = decode(&bytes).ok_or_else(no_number)?;
        }
        Ok(numbers)
    }

    /// A number below `end`.
    fn below(&mut self, end: u64, what: &str) -> std::result::Result<u64, Wrong> {
        let number = self.number()?;
        if number < end { Ok(number) } else { Err(Wrong::data(&format!("{what} below {end}, found {number}"))) }
    }

    fn text(&mut self) -> std::result::Result<String, Wrong> {
        let length = self.below(self.left.saturating_add(1), "a text's length")?;
        let mut bytes = Vec::new();
        self.left -= length;
        self.inner.by_ref().take(length).read_to_end(&mut bytes).map_err(Wrong::Io)?;
        String::from_utf8(bytes).map_err(|_| Wrong::data("text in UTF-8"))
    }

    /// Quanta along a voxel's side, and what comes before the bricks.
    fn summary(&mut self) -> std::result::Result<(u32, Summary), Wrong> {
        let quanta = self.number()?;
        let quanta = u32::try_from(quanta).ok().filter(|quanta| VOXEL_QUANTA.contains(quanta));
        let quanta = quanta.ok_or_else(|| Wrong::data("voxels of 1 cm to 5 m"))?;
        let kept = if self.below(2, "what voxels keep")? == 0 { Kept::Moments } else { Kept::Occupancy };
        let about = self.text()?;
        let count = self.below(u64::from(u32::MAX), "a number of scans")?;
        let (mut scans, mut points) = (Vec::<ScanEvidence>::new(), 0_u64);
        for _ in 0..count {
            let key = self.text()?;
            if scans.last().is_some_and(|last| last.key >= key) {
                return Err(Wrong::data("scans in the order of their keys"));
            }
            let of_scan = self.number()?;
            points = points.checked_add(of_scan).ok_or_else(|| Wrong::data("less than 2^64 points"))?;
            let mut position = None;
            if self.below(2, "whether a position follows")? == 1 {
                let place = [self.bytes()?, self.bytes()?, self.bytes()?].map(f64::from_le_bytes);
                if !place.iter().all(|v| v.is_finite()) {
                    return Err(Wrong::data("finite positions of scans"));
                }
                position = Some(place);
            }
            scans.push(ScanEvidence { key, position, points: of_scan });
        }
        let voxel = Evidence::with_quanta(quanta, kept).voxel();
        Ok((quanta, Summary { voxel, kept, points, about, scans }))
    }

    /// Hand on the bricks; returns the points that their voxels count.
    fn bricks(
        &mut self,
        scans: u32,
        quanta: u32,
        kept: Kept,
        mut take: impl FnMut([i32; 3], &[u32], &[(u16, Moments)]),
    ) -> std::result::Result<u64, Wrong> {
        // Voxel indices must fit 32 bits.
        let within = i64::from(i32::MIN >> SIDE_BITS)..=i64::from(i32::MAX >> SIDE_BITS);
        let (mut before, mut points) = ([0_i32; 3], 0_u64);
        let (mut of_brick, mut voxels) = (Vec::new(), Vec::new());
        let count = self.number()?;
        for number in 0..count {
            let mut key = [0; 3];
            for axis in 0..3 {
                let step = self.number()?;
                let step = (step >> 1) as i64 ^ -((step & 1) as i64);
                let index = i64::from(before[axis]).checked_add(step).filter(|index| within.contains(index));
                key[axis] = index.ok_or_else(|| Wrong::data("bricks within 100,000 km"))? as i32;
            }
            if number > 0 && key <= before {
                return Err(Wrong::data("bricks in the order of their indices"));
            }
            before = key;
            of_brick.clear();
            let mut next = 0;
            for _ in 0..self.below(u64::from(scans) + 1, "a number of scans")? {
                let scan = self.below(u64::from(scans - next), "a scan")? as u32 + next;
                of_brick.push(scan);
                next = scan + 1;
            }
            voxels.clear();
            let mut next = 0;
            for _ in 0..=self.below(BRICK_VOXELS as u64, "a number of voxels")? {
                let (step, moments) =
                    if kept == Kept::Moments { self.moments(quanta)? } else { (self.number()?, Moments::default()) };
                if step >= (BRICK_VOXELS - next) as u64 {
                    return Err(Wrong::data(&format!(
                        "a place in a brick below {}, found {step}",
                        BRICK_VOXELS - next
                    )));
                }
                let place = step as usize + next;
                points = points.saturating_add(moments.count);
                voxels.push((place as u16, moments));
                next = place + 1;
            }
            take(key, &of_brick, &voxels);
        }
        Ok(points)
    }

    /// The step to the place of a voxel, and sums that points within it can have.
    #[inline]
    fn moments(&mut self, quanta: u32) -> std::result::Result<(u64, Moments), Wrong> {
        let impossible = || Wrong::data("sums that points within a voxel can have");
        let [step, count, moments @ ..] = self.numbers::<8>()?;
        let greatest = u64::from(quanta) - 1;
        let (sums, products) = (count.checked_mul(greatest), count.checked_mul(greatest * greatest));
        let (Some(sums), Some(products), true) = (sums, products, count > 0) else { return Err(impossible()) };
        let [x, y, z, xx, xy, yy] = moments;
        let (sum, product) = ([x, y, z], [xx, xy, yy]);
        if sum.iter().any(|&v| v > sums) || product.iter().any(|&v| v > products) {
            return Err(impossible());
        }
        Ok((step, Moments { count, sum, products: product }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_any_length_are_read_as_written() {
        let edges = (0..64).flat_map(|bits| [1_u64 << bits, (1 << bits) - 1]).chain([u64::MAX, 0x1234_5678_9abc_def0]);
        for number in edges {
            let (bytes, length) = encode(number);
            assert_eq!(decode(&bytes), Some((number, length)));
            let simple: Vec<_> = (0..length).map(|i| (number >> (7 * i)) as u8 & 0x7f).collect();
            assert!(bytes[..length].iter().zip(&simple).all(|(byte, seven)| byte & 0x7f == *seven), "{number}");
            assert!(bytes[..length - 1].iter().all(|byte| byte & 0x80 != 0) && bytes[length - 1] < 0x80, "{number}");
        }
    }
}
