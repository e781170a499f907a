//! PCD of the Point Cloud Library: ascii, binary and binary_compressed. A compressed cloud is a single LZF block, field
//! after field; it is unpacked whole, and refused beyond [`LARGEST_BLOCK`].

use super::input::{Input, u32_at};
use super::lines::{Columns, Lines, byte_part, byte_parts, read_points};
use super::records::{Records, Scalar};
use super::{Batch, Collector, Header, Scan, Skipped, Source};
use crate::{Error, Result};

/// A longer header is no header.
const LONGEST_HEADER: usize = 64 * 1024;

/// Most bytes that a compressed cloud may unpack to.
const LARGEST_BLOCK: u64 = 1 << 30;

/// An opened PCD file.
pub(super) struct Pcd {
    input: Input,
    header: Header,
    data: Data,
}

enum Data {
    Ascii {
        start: u64,
        columns: Columns,
    },
    Binary(Records),
    /// `records` tells where the fields would be if they were not compressed.
    Compressed(Records),
}

/// One field of the points.
struct Field {
    name: String,
    size: usize,
    kind: char,
    count: usize,
}

impl Field {
    fn bytes(&self) -> usize {
        self.size * self.count
    }

    fn scalar(&self) -> Option<Scalar> {
        Some(match (self.kind, self.size) {
            ('F', 4) => Scalar::F32,
            ('F', 8) => Scalar::F64,
            ('I', 1) => Scalar::I8,
            ('I', 2) => Scalar::I16,
            ('I', 4) => Scalar::I32,
            ('I', 8) => Scalar::I64,
            ('U', 1) => Scalar::U8,
            ('U', 2) => Scalar::U16,
            ('U', 4) => Scalar::U32,
            ('U', 8) => Scalar::U64,
            _ => return None,
        })
    }
}

impl Pcd {
    /// Read the header and check it against the file.
    pub fn open(input: Input) -> Result<Self> {
        let about = About::parse(&input)?;
        let fields = &about.fields;
        let place = |name: &str| fields.iter().position(|field| field.name == name && field.count == 1);
        let (Some(x), Some(y), Some(z)) = (place("x"), place("y"), place("z")) else {
            let names: Vec<_> = fields.iter().map(|field| field.name.as_str()).collect();
            return Err(input.bad(format!("expected fields x, y, z, found {}", names.join(", "))));
        };
        let axis = |i: usize| {
            let scalar = fields[i].scalar().ok_or_else(|| {
                input.bad(format!("expected numbers, found type {} of {} bytes", fields[i].kind, fields[i].size))
            })?;
            Ok((fields[..i].iter().map(Field::bytes).sum(), scalar))
        };
        let records = Records {
            start: about.start,
            count: about.points,
            length: fields.iter().map(Field::bytes).sum(),
            axes: [axis(x)?, axis(y)?, axis(z)?],
            is_big_endian: false,
        };
        let data = match about.data.as_str() {
            "ascii" => {
                let column = |i: usize| fields[..i].iter().map(|field| field.count).sum();
                let columns = Columns::new([column(x), column(y), column(z)], None, false);
                Data::Ascii { start: about.start, columns }
            }
            "binary" => {
                records.check(&input)?;
                Data::Binary(records)
            }
            "binary_compressed" => Data::Compressed(records),
            other => return Err(input.bad(format!("expected DATA ascii, binary or binary_compressed, found {other}"))),
        };
        // A line of a point has two bytes at least; LZF makes at most 264 bytes from 3.
        if about.points > (input.len() - about.start).saturating_mul(100) {
            let message =
                format!("the header promises {} points, more than the file holds; it is cut short", about.points);
            return Err(input.bad(message));
        }
        let key = format!("pcd:{}", input.content_key(0)?);
        let points = Some(about.points);
        let header = Header {
            format: format!("PCD, {}", about.data),
            points,
            scans: vec![Scan { number: 0, key: key.clone(), name: None, position: None, points }],
            key,
            notes: about.notes,
            ..Header::default()
        };
        Ok(Self { input, header, data })
    }
}

impl Source for Pcd {
    fn header(&self) -> &Header {
        &self.header
    }

    fn parts(&self) -> usize {
        match &self.data {
            Data::Ascii { start, .. } => byte_parts(*start..self.input.len()),
            Data::Binary(records) => records.parts(),
            Data::Compressed(_) => 1,
        }
    }

    fn read(&self, part: usize, sink: &mut dyn FnMut(&Batch) -> Result<()>) -> Result<Skipped> {
        let mut collector = Collector::new(0, sink);
        match &self.data {
            Data::Ascii { start, columns } => {
                let lines = Lines::within(&self.input, byte_part(*start..self.input.len(), part), *start)?;
                let push = |p, collector: &mut Collector<'_>| collector.push(p);
                read_points(&self.input, lines, columns, &mut collector, push, |_| false)?;
            }
            Data::Binary(records) => records.read(&self.input, part, &mut collector)?,
            Data::Compressed(records) if records.count > 0 => {
                let block = unpack(&self.input, records)?;
                // Field after field: all x, then all y, and so on.
                let values =
                    |(at, scalar): (usize, Scalar)| block[at * records.count as usize..].chunks_exact(scalar.size());
                let [x, y, z] = records.axes;
                for ((a, b), c) in values(x).zip(values(y)).zip(values(z)).take(records.count as usize) {
                    collector.push([x.1.value(a, false), y.1.value(b, false), z.1.value(c, false)])?;
                }
            }
            Data::Compressed(_) => {}
        }
        collector.finish()
    }
}

/// What the header says.
struct About {
    fields: Vec<Field>,
    points: u64,
    data: String,
    start: u64,
    notes: Vec<String>,
}

impl About {
    fn parse(input: &Input) -> Result<Self> {
        let head = input.head(LONGEST_HEADER)?;
        let (mut names, mut sizes, mut kinds, mut counts) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let (mut width, mut height, mut points, mut notes, mut start) = (None, 1, None, Vec::new(), 0);
        for line in head.split_inclusive(|&byte| byte == b'\n') {
            start += line.len() as u64;
            let text = String::from_utf8_lossy(line);
            let mut words = text.split_whitespace();
            let key = words.next().unwrap_or_default();
            let words: Vec<_> = words.collect();
            let numbers = || words.iter().map(|word| word.parse().ok()).collect::<Option<Vec<u64>>>();
            let bad = || input.bad(format!("expected a line of a PCD header, found {:?}", text.trim()));
            let one = || numbers().and_then(|n| n.first().copied()).ok_or_else(bad);
            match key {
                "" | "VERSION" => {}
                _ if key.starts_with('#') => {}
                "FIELDS" | "COLUMNS" => names = words.iter().map(|word| (*word).to_owned()).collect(),
                "SIZE" => sizes = numbers().ok_or_else(bad)?,
                "TYPE" => kinds = words.iter().filter_map(|word| word.chars().next()).collect(),
                "COUNT" => counts = numbers().ok_or_else(bad)?,
                "WIDTH" => width = Some(one()?),
                "HEIGHT" => height = one()?,
                "POINTS" => points = Some(one()?),
                "VIEWPOINT" => {
                    if words != ["0", "0", "0", "1", "0", "0", "0"] {
                        notes.push(format!("its viewpoint ({}) is not applied to the points", words.join(" ")));
                    }
                }
                "DATA" => {
                    let data = words.first().copied().unwrap_or_default().to_lowercase();
                    let points = points.or_else(|| width?.checked_mul(height)).ok_or_else(|| {
                        input.bad("expected the number of points in the PCD header, found neither POINTS nor WIDTH")
                    })?;
                    let fields = Self::fields(input, names, &sizes, &kinds, &counts)?;
                    return Ok(Self { fields, points, data, start, notes });
                }
                _ => return Err(bad()),
            }
        }
        Err(input.bad("expected a line DATA in the PCD header, found none; it is cut short"))
    }

    fn fields(input: &Input, names: Vec<String>, sizes: &[u64], kinds: &[char], counts: &[u64]) -> Result<Vec<Field>> {
        let is_even = sizes.len() == names.len() && kinds.len() == names.len();
        // Beyond these no point cloud goes, and sums stay far from overflow.
        let is_small = sizes.iter().all(|&size| (1..=8).contains(&size))
            && counts.iter().all(|&count| count <= 1 << 16)
            && names.len() <= 1 << 10;
        if !is_even || !is_small || !(counts.is_empty() || counts.len() == names.len()) {
            return Err(input.bad("expected as many sizes (1 to 8), types and counts as fields in the PCD header"));
        }
        let field = |(i, name): (usize, String)| Field {
            name: name.to_lowercase(),
            size: sizes[i] as usize,
            kind: kinds[i],
            count: counts.get(i).map_or(1, |&count| count as usize),
        };
        Ok(names.into_iter().enumerate().map(field).collect())
    }
}

/// Unpack a compressed cloud, whose size must be what the fields need.
fn unpack(input: &Input, records: &Records) -> Result<Vec<u8>> {
    let mut sizes = [0; 8];
    input.read_at(records.start, &mut sizes)?;
    let (packed, unpacked) = (u64::from(u32_at(&sizes, 0)), u64::from(u32_at(&sizes, 4)));
    if records.count.checked_mul(records.length as u64) != Some(unpacked) {
        return Err(input.bad(format!(
            "expected a block of {} points x {} bytes, found one of {unpacked} bytes",
            records.count, records.length
        )));
    }
    if unpacked > LARGEST_BLOCK {
        let message =
            format!("its compressed block unpacks to {unpacked} bytes; save it as binary, which has no limit");
        return Err(Error::unsupported(input.path(), message));
    }
    let mut bytes = Vec::new();
    input.read_into(records.start + 8, packed, &mut bytes)?;
    let block = unpack_lzf(&bytes, unpacked as usize).filter(|block| block.len() as u64 == unpacked);
    block.ok_or_else(|| input.bad("its compressed block is damaged"))
}

/// LZF: a control byte below 32 is followed by that many bytes and one more, any other points back at bytes to repeat.
fn unpack_lzf(mut packed: &[u8], expected: usize) -> Option<Vec<u8>> {
    // Grown as it fills: what the header claims costs nothing.
    let mut block = Vec::with_capacity(expected.min(packed.len().saturating_mul(4)));
    let mut take = |count: usize| {
        let (taken, rest) = packed.split_at_checked(count)?;
        packed = rest;
        Some(taken)
    };
    while let Some(&[control]) = take(1) {
        let control = usize::from(control);
        if control < 32 {
            block.extend_from_slice(take(control + 1)?);
        } else {
            let mut length = control >> 5;
            if length == 7 {
                length += usize::from(take(1)?[0]);
            }
            let distance = ((control & 31) << 8 | usize::from(take(1)?[0])) + 1;
            let start = block.len().checked_sub(distance)?;
            // The bytes to repeat may overlap those they make.
            for i in start..start + length + 2 {
                block.push(block[i]);
            }
        }
        if block.len() > expected {
            return None;
        }
    }
    Some(block)
}
