//! PLY: a header that lists elements and their properties, then their values as text or in either byte order. Only the
//! vertices matter; what comes before them is passed over.

use std::io::{BufRead, BufReader, Read};
use std::ops::Range;

use super::input::{Input, Stream};
use super::lines::{Columns, Lines, byte_part, byte_parts, read_points, skip_lines};
use super::records::{Records, Scalar};
use super::{Batch, Collector, Header, Scan, Skipped, Source};
use crate::{Error, Result};

/// A longer header is no header.
const LONGEST_HEADER: usize = 1 << 20;

/// An opened PLY file.
pub(super) struct Ply {
    input: Input,
    header: Header,
    vertices: Vertices,
}

/// How the vertices are stored.
enum Vertices {
    /// Binary records of equal length.
    Records(Records),
    /// Binary records with lists, which must be read one after the other.
    Ragged { start: u64, count: u64, properties: Vec<Property>, axes: [usize; 3], is_big_endian: bool },
    /// Lines.
    Lines { all: Range<u64>, columns: Columns },
}

#[derive(Debug)]
struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

#[derive(Debug, Clone)]
struct Property {
    name: String,
    /// The type of the number of values, if it is a list.
    count: Option<Scalar>,
    value: Scalar,
}

impl Element {
    /// Bytes of a record, if all are equally long.
    fn length(&self) -> Option<usize> {
        self.properties.iter().map(|p| p.count.is_none().then(|| p.value.size())).sum()
    }
}

impl Ply {
    /// Read the header and find the vertices.
    pub fn open(input: Input) -> Result<Self> {
        let (format, elements, start) = parse_header(&input)?;
        let Some(place) = elements.iter().position(|element| element.name == "vertex") else {
            return Err(input.bad("expected an element vertex, found none"));
        };
        let (before, vertex) = (&elements[..place], &elements[place]);
        let axis = |name: &str| vertex.properties.iter().position(|p| p.count.is_none() && p.name == name);
        let (Some(x), Some(y), Some(z)) = (axis("x"), axis("y"), axis("z")) else {
            let names: Vec<_> = vertex.properties.iter().map(|p| p.name.as_str()).collect();
            return Err(input.bad(format!("expected vertices with x, y, z, found {}", names.join(", "))));
        };
        let vertices = if format == "ascii" {
            let list = vertex.properties[..x.max(y).max(z)].iter().find(|p| p.count.is_some());
            if let Some(list) = list {
                let message = format!("expected x, y, z before any list, found the list {} first", list.name);
                return Err(Error::unsupported(input.path(), message));
            }
            Vertices::open_lines(&input, before, vertex, start, [x, y, z])?
        } else {
            Vertices::open_binary(&input, before, vertex, start, [x, y, z], format == "binary_big_endian")?
        };
        let key = format!("ply:{}", input.content_key(0)?);
        let header = Header {
            format: format!("PLY, {}", format.replace('_', " ")),
            points: Some(vertex.count),
            scans: vec![Scan { number: 0, key: key.clone(), name: None, position: None, points: Some(vertex.count) }],
            key,
            ..Header::default()
        };
        Ok(Self { input, header, vertices })
    }
}

impl Vertices {
    fn open_lines(input: &Input, before: &[Element], vertex: &Element, start: u64, xyz: [usize; 3]) -> Result<Self> {
        let lines = before.iter().map(|element| element.count).try_fold(0u64, u64::checked_add);
        let cut_short =
            || input.bad(format!("the header promises {} points, the file holds fewer; it is cut short", vertex.count));
        // A line has two bytes or more, but for elements without properties.
        let fits = |count: u64| count <= input.len();
        let lines = lines.filter(|&lines| fits(lines) && fits(vertex.count)).ok_or_else(cut_short)?;
        let start = skip_lines(input, start, lines)?.ok_or_else(cut_short)?;
        let end = skip_lines(input, start, vertex.count)?.ok_or_else(cut_short)?;
        Ok(Self::Lines { all: start..end, columns: Columns::new(xyz, None, false) })
    }

    fn open_binary(
        input: &Input,
        before: &[Element],
        vertex: &Element,
        mut start: u64,
        xyz: [usize; 3],
        is_big_endian: bool,
    ) -> Result<Self> {
        let too_long = || input.bad("the elements before the vertices are longer than the file; it is cut short");
        for element in before {
            start = match element.length() {
                Some(length) => element
                    .count
                    .checked_mul(length as u64)
                    .and_then(|bytes| bytes.checked_add(start))
                    .ok_or_else(too_long)?,
                None => {
                    let mut walk = Walk::new(input, start, is_big_endian);
                    for _ in 0..element.count {
                        walk.pass(&element.properties)?;
                    }
                    walk.position
                }
            };
            if start > input.len() {
                return Err(too_long());
            }
        }
        let Some(length) = vertex.length() else {
            let properties = vertex.properties.clone();
            return Ok(Self::Ragged { start, count: vertex.count, properties, axes: xyz, is_big_endian });
        };
        let offset = |property: usize| vertex.properties[..property].iter().map(|p| p.value.size()).sum();
        let axes = xyz.map(|property| (offset(property), vertex.properties[property].value));
        let records = Records { start, count: vertex.count, length, axes, is_big_endian };
        records.check(input)?;
        Ok(Self::Records(records))
    }
}

impl Source for Ply {
    fn header(&self) -> &Header {
        &self.header
    }

    fn parts(&self) -> usize {
        match &self.vertices {
            Vertices::Records(records) => records.parts(),
            Vertices::Ragged { .. } => 1,
            Vertices::Lines { all, .. } => byte_parts(all.clone()),
        }
    }

    fn read(&self, part: usize, sink: &mut dyn FnMut(&Batch) -> Result<()>) -> Result<Skipped> {
        let mut collector = Collector::new(0, sink);
        match &self.vertices {
            Vertices::Records(records) => records.read(&self.input, part, &mut collector)?,
            Vertices::Ragged { start, count, properties, axes, is_big_endian } => {
                let mut walk = Walk::new(&self.input, *start, *is_big_endian);
                for _ in 0..*count {
                    walk.pass(properties)?;
                    collector.push(axes.map(|axis| walk.values[axis]))?;
                }
            }
            Vertices::Lines { all, columns } => {
                let lines = Lines::within(&self.input, byte_part(all.clone(), part), all.start)?;
                let push = |p, collector: &mut Collector<'_>| collector.push(p);
                read_points(&self.input, lines, columns, &mut collector, push, |_| false)?;
            }
        }
        collector.finish()
    }
}

/// Goes through binary records with lists.
struct Walk<'a> {
    input: &'a Input,
    stream: BufReader<Stream<'a>>,
    is_big_endian: bool,
    position: u64,
    /// The values of the record passed last; 0 for lists.
    values: Vec<f64>,
}

impl<'a> Walk<'a> {
    fn new(input: &'a Input, position: u64, is_big_endian: bool) -> Self {
        let stream = BufReader::with_capacity(1 << 18, input.stream(position));
        Self { input, stream, is_big_endian, position, values: Vec::new() }
    }

    /// Read one record.
    fn pass(&mut self, properties: &[Property]) -> Result<()> {
        self.values.clear();
        for property in properties {
            let value = match property.count {
                None => self.value(property.value)?,
                Some(count) => {
                    let count = self.value(count)?.max(0.0) as u64;
                    self.skip(count.saturating_mul(property.value.size() as u64))?;
                    0.0
                }
            };
            self.values.push(value);
        }
        Ok(())
    }

    fn value(&mut self, scalar: Scalar) -> Result<f64> {
        let mut bytes = [0; 8];
        self.stream.read_exact(&mut bytes[..scalar.size()]).map_err(|e| Error::io(self.input.path(), e))?;
        self.position += scalar.size() as u64;
        Ok(scalar.value(&bytes, self.is_big_endian))
    }

    fn skip(&mut self, bytes: u64) -> Result<()> {
        if bytes > self.input.len() - self.position.min(self.input.len()) {
            return Err(self.input.bad("a list runs over the end of the file; it is cut short or damaged"));
        }
        self.stream.seek_relative(bytes as i64).map_err(|e| Error::io(self.input.path(), e))?;
        self.position += bytes;
        Ok(())
    }
}

/// The format, the elements, and the byte at which the data begins.
fn parse_header(input: &Input) -> Result<(String, Vec<Element>, u64)> {
    let head = input.head(LONGEST_HEADER)?;
    let (mut format, mut elements, mut at) = (None, Vec::<Element>::new(), 0);
    let mut rest = head.as_slice();
    let mut line = Vec::new();
    loop {
        line.clear();
        let length = rest.read_until(b'\n', &mut line).map_err(|e| Error::io(input.path(), e))?;
        if length == 0 {
            return Err(input.bad("expected end_header, found the end of the header's text; it is cut short"));
        }
        at += length as u64;
        let text = String::from_utf8_lossy(&line);
        let words: Vec<_> = text.split_whitespace().collect();
        let unknown = || input.bad(format!("expected a line of a PLY header, found {:?}", text.trim()));
        match words.as_slice() {
            ["ply"] | ["comment" | "obj_info", ..] | [] => {}
            ["format", name @ ("ascii" | "binary_little_endian" | "binary_big_endian"), _] => {
                format = Some((*name).to_owned());
            }
            ["element", name, count] => {
                let count = count.parse().map_err(|_| unknown())?;
                elements.push(Element { name: (*name).to_owned(), count, properties: Vec::new() });
            }
            ["property", rest @ ..] => {
                let property = parse_property(rest).ok_or_else(unknown)?;
                elements.last_mut().ok_or_else(unknown)?.properties.push(property);
            }
            ["end_header"] => break,
            _ => return Err(unknown()),
        }
    }
    let format = format.ok_or_else(|| input.bad("expected a line format in the PLY header, found none"))?;
    Ok((format, elements, at))
}

fn parse_property(words: &[&str]) -> Option<Property> {
    match words {
        ["list", count, value, name] => {
            Some(Property { name: (*name).to_owned(), count: Some(scalar(count)?), value: scalar(value)? })
        }
        [value, name] => Some(Property { name: (*name).to_lowercase(), count: None, value: scalar(value)? }),
        _ => None,
    }
}

fn scalar(name: &str) -> Option<Scalar> {
    Some(match name {
        "char" | "int8" => Scalar::I8,
        "uchar" | "uint8" => Scalar::U8,
        "short" | "int16" => Scalar::I16,
        "ushort" | "uint16" => Scalar::U16,
        "int" | "int32" => Scalar::I32,
        "uint" | "uint32" => Scalar::U32,
        "float" | "float32" => Scalar::F32,
        "double" | "float64" => Scalar::F64,
        _ => return None,
    })
}
