//! E57 (ASTM E2807): several scans with poses, Cartesian or spherical, as floats, doubles or scaled integers.
//!
//! The `e57` crate reads the header and the XML. The points are decoded here, since it boxes each value: a scan is
//! a run of packets, each of which carries a piece of one byte stream per field. The pieces of a stream, laid end
//! to end, are its values, bit after bit; so record n of a field of b bits begins at bit n b, and a scan can be
//! entered anywhere once its packets are indexed. Every page's checksum is verified.

use std::iter::empty;
use std::ops::Range;
use std::sync::OnceLock;

use e57::{E57Reader, PointCloud, RecordDataType, RecordName};

use super::input::{Fnv, Input, f64_at, u16_at, u32_at, u64_at};
use super::{BATCH, Batch, Collector, Header, PART, Scan, Skipped, Source, guarded};
use crate::{Error, Result};

/// Bytes of checksum at the end of each page.
const CHECKSUM: u64 = 4;

/// Physical bytes that are read and verified together.
const WINDOW: u64 = 1 << 20;

/// Zero bytes behind a stream's bytes, so that eight or sixteen can be taken at once anywhere.
const PADDING: usize = 16;

/// An opened E57 file.
pub(super) struct E57 {
    input: Input,
    page_size: u64,
    header: Header,
    clouds: Vec<Cloud>,
    /// Cloud and records of each part.
    parts: Vec<(usize, Range<u64>)>,
}

impl E57 {
    /// Read the header and the XML section.
    pub fn open(input: Input) -> Result<Self> {
        let head = input.head(48)?;
        if head.len() < 48 {
            return Err(input.bad(format!("expected an E57 header of 48 bytes, found {} bytes", head.len())));
        }
        let (length, xml_length, page_size) = (u64_at(&head, 16), u64_at(&head, 32), u64_at(&head, 40));
        if length > input.len() || xml_length > input.len() {
            return Err(input.bad(format!(
                "the header promises {} bytes, the file holds {}; it is cut short",
                length.max(xml_length),
                input.len()
            )));
        }
        let reader = guarded(&input, || E57Reader::new(input.stream(0)).map_err(|e| bad_e57(&input, e)))?;
        let mut header = Header {
            format: format!("E57 {}.{}", u32_at(&head, 8), u32_at(&head, 12)),
            points: Some(0),
            key: format!("e57:{}", reader.guid()),
            crs: reader.coordinate_metadata().map(str::trim).filter(|crs| !crs.is_empty()).map(str::to_owned),
            ..Header::default()
        };
        let (mut clouds, mut parts) = (Vec::new(), Vec::new());
        let described = reader.pointclouds();
        for pc in &described {
            let number = clouds.len();
            let Some(cloud) = Cloud::new(&input, pc)? else {
                header.notes.push(format!("scan {} has no coordinates", name(pc)));
                continue;
            };
            let alike = described.iter().filter(|other| other.guid == pc.guid).count();
            header.scans.push(Scan {
                number: number as u32,
                key: key(pc, alike > 1),
                name: pc.name.clone(),
                position: cloud.position,
                points: Some(pc.records),
            });
            header.points = header.points.and_then(|sum| sum.checked_add(pc.records));
            let starts = (0..pc.records).step_by(PART as usize);
            parts.extend(starts.map(|from| (number, from..(from + PART).min(pc.records))));
            clouds.push(cloud);
        }
        header.bounds = bounds(&clouds);
        Ok(Self { input, page_size, header, clouds, parts })
    }
}

impl Source for E57 {
    fn header(&self) -> &Header {
        &self.header
    }

    fn parts(&self) -> usize {
        self.parts.len().max(1)
    }

    fn read(&self, part: usize, sink: &mut dyn FnMut(&Batch) -> Result<()>) -> Result<Skipped> {
        let Some((number, records)) = self.parts.get(part).cloned() else { return Ok(Skipped::default()) };
        let cloud = &self.clouds[number];
        let mut collector = Collector::new(number as u32, sink);
        cloud.read(&mut Pages::new(&self.input, self.page_size, WINDOW), records, &mut collector)?;
        collector.finish()
    }
}

/// The points of one scan: where their fields are and how they become coordinates.
struct Cloud {
    records: u64,
    /// Byte streams in each packet, ours and those we pass over.
    streams: usize,
    /// x, y, z or range, azimuth, elevation, and the invalid state where there is one.
    fields: Vec<Field>,
    spherical: bool,
    rotation: [f64; 9],
    translation: [f64; 3],
    position: Option<[f64; 3]>,
    bounds: Option<[[f64; 3]; 2]>,
    /// Physical place of the compressed vector section.
    section: u64,
    /// Found out when the first part is read.
    packets: OnceLock<std::result::Result<Vec<Packet>, String>>,
}

/// A data packet: where it is, and how many bytes of each of our streams came before it.
struct Packet {
    at: u64,
    before: [u64; 4],
}

impl Cloud {
    /// `None` if the scan has no coordinates at all.
    fn new(input: &Input, pc: &PointCloud) -> Result<Option<Self>> {
        let find = |name: RecordName| -> Option<Field> {
            let stream = pc.prototype.iter().position(|record| record.name == name)?;
            Some(Field::new(stream, &pc.prototype[stream].data_type))
        };
        let all = |names: [RecordName; 3]| names.into_iter().map(find).collect::<Option<Vec<_>>>();
        let cartesian = all([RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ]);
        let spherical = cartesian.is_none();
        let (fields, state) = match cartesian {
            Some(fields) => (Some(fields), RecordName::CartesianInvalidState),
            None => (
                all([RecordName::SphericalRange, RecordName::SphericalAzimuth, RecordName::SphericalElevation]),
                RecordName::SphericalInvalidState,
            ),
        };
        let Some(mut fields) = fields else { return Ok(None) };
        fields.extend(find(state));

        let bits: u64 = fields.iter().map(|field| u64::from(field.bits)).sum();
        if pc.records > 0 && (bits == 0 || pc.records > input.len() * 8 / bits) {
            return Err(input.bad(format!(
                "scan {} promises {} points, more than the file can hold",
                name(pc),
                pc.records
            )));
        }
        let (rotation, translation) = pose(pc);
        if rotation.iter().chain(&translation).any(|v| !v.is_finite()) {
            return Err(input.bad(format!("the pose of scan {} is not finite", name(pc))));
        }
        // Without a pose the scanner is known to be the origin only if the scan is still a grid of directions.
        let is_grid = spherical || pc.prototype.iter().any(|record| record.name == RecordName::RowIndex);
        let is_posed = translation != [0.0; 3] || rotation != IDENTITY;
        // Bounds are the scanner's own, but some writers give the file's: believe them where both are the same.
        let bounds = pc
            .cartesian_bounds
            .as_ref()
            .filter(|_| !is_posed)
            .and_then(|b| Some([[b.x_min?, b.y_min?, b.z_min?], [b.x_max?, b.y_max?, b.z_max?]]));
        Ok(Some(Self {
            records: pc.records,
            streams: pc.prototype.len(),
            fields,
            spherical,
            rotation,
            translation,
            position: (is_grid || is_posed).then_some(translation),
            bounds,
            section: pc.file_offset,
            packets: OnceLock::new(),
        }))
    }

    /// From the scanner's frame to the file's.
    #[inline]
    fn to_file(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let (r, t) = (&self.rotation, &self.translation);
        [
            r[0] * x + r[3] * y + r[6] * z + t[0],
            r[1] * x + r[4] * y + r[7] * z + t[1],
            r[2] * x + r[5] * y + r[8] * z + t[2],
        ]
    }

    /// Find the packets; done once, by whichever part comes first.
    fn packets(&self, pages: &Pages<'_>) -> Result<&[Packet]> {
        let input = pages.input;
        let packets = self.packets.get_or_init(|| {
            self.index(&mut Pages::new(input, pages.page_size, 1)).map_err(|error| match error {
                Error::BadFile { message, .. } => message,
                other => other.to_string(),
            })
        });
        packets.as_deref().map_err(|message| input.bad(message))
    }

    /// Walk from packet to packet until our streams hold all records.
    fn index(&self, pages: &mut Pages<'_>) -> Result<Vec<Packet>> {
        let start = pages.logical(self.section)?;
        let section = pages.get(start, 32)?;
        let (kind, data) = (section[0], u64_at(section, 16));
        if kind != 1 {
            return Err(pages.input.bad(format!("expected points (section 1) at byte {}, found {kind}", self.section)));
        }
        let (mut at, mut before, mut packets) = (pages.logical(data)?, [0; 4], Vec::new());
        let is_enough = |before: &[u64; 4]| {
            self.fields.iter().zip(before).all(|(field, bytes)| bytes * 8 >= self.records * u64::from(field.bits))
        };
        while !is_enough(&before) {
            let (length, sizes) = self.packet(pages, at)?;
            if let Some(pieces) = sizes {
                packets.push(Packet { at, before });
                for (bytes, piece) in before.iter_mut().zip(pieces) {
                    *bytes += piece.len() as u64;
                }
            }
            at += length;
        }
        Ok(packets)
    }

    /// The length of the packet at `at`, and where in it the pieces of our streams are, if it has any. Looks only at
    /// the packet's head.
    fn packet(&self, pages: &mut Pages<'_>, at: u64) -> Result<(u64, Option<[Range<usize>; 4]>)> {
        let head = pages.get(at, 4)?;
        let (kind, length) = (head[0], usize::from(u16_at(head, 2)) + 1);
        if kind > 2 || length % 4 != 0 {
            return Err(pages.input.bad(format!("expected a packet of points, found type {kind}, {length} bytes")));
        }
        if kind != 1 {
            return Ok((length as u64, None));
        }
        let mut piece = 6 + 2 * self.streams;
        let head = pages.get(at, piece.min(length))?;
        if head.len() < piece || usize::from(u16_at(head, 4)) != self.streams {
            return Err(pages.input.bad(format!("expected a packet of {} fields, found other data", self.streams)));
        }
        let mut pieces = [0..0, 0..0, 0..0, 0..0];
        for stream in 0..self.streams {
            let end = piece + usize::from(u16_at(head, 6 + 2 * stream));
            if let Some(ours) = self.fields.iter().position(|field| field.stream == stream) {
                pieces[ours] = piece..end;
            }
            piece = end;
        }
        if piece > length {
            return Err(pages.input.bad("a packet of points is longer than it says; the file is damaged"));
        }
        Ok((length as u64, Some(pieces)))
    }

    /// Decode a range of records.
    fn read(&self, pages: &mut Pages<'_>, records: Range<u64>, collector: &mut Collector<'_>) -> Result<()> {
        let packets = self.packets(pages)?;
        let mut streams: Vec<_> = self.fields.iter().map(|field| Stream::new(field, records.start)).collect();
        let holds = |packet: &Packet| packet.before.iter().zip(&streams).all(|(before, s)| *before <= s.next_byte);
        let first = packets.partition_point(holds).saturating_sub(1);
        let mut left = records.end - records.start;
        for packet in &packets[first..] {
            if left == 0 {
                break;
            }
            let (length, pieces) = self.packet(pages, packet.at)?;
            let bytes = pages.get(packet.at, length as usize)?;
            for ((stream, piece), before) in streams.iter_mut().zip(pieces.unwrap_or_default()).zip(packet.before) {
                stream.append(&bytes[piece], before);
            }
            loop {
                let whole = streams.iter().map(Stream::available).min().unwrap_or(0);
                let count = whole.min(left).min(BATCH as u64) as usize;
                if count == 0 {
                    break;
                }
                streams.iter_mut().for_each(|stream| stream.unpack(count));
                self.convert(&streams, count, collector)?;
                left -= count as u64;
            }
        }
        if left > 0 {
            return Err(pages.input.bad("the points end before their number is reached; the file is cut short"));
        }
        Ok(())
    }

    /// Hand on the values just unpacked as points.
    fn convert(&self, streams: &[Stream<'_>], count: usize, collector: &mut Collector<'_>) -> Result<()> {
        let [a, b, c] = [0, 1, 2].map(|i| &streams[i].values[..count]);
        let state = streams.get(3).map(|stream| &stream.values[..count]);
        let points = a.iter().zip(b).zip(c).map(|((&a, &b), &c)| [a, b, c]);
        match (state, self.spherical) {
            (None, false) => collector.extend(points.map(|point| self.to_file(point)), empty()),
            (None, true) => collector.extend(points.map(|point| self.to_file(to_cartesian(point))), empty()),
            (Some(state), _) => {
                for (point, state) in points.zip(state) {
                    match *state {
                        0.0 if self.spherical => collector.push(self.to_file(to_cartesian(point)))?,
                        0.0 => collector.push(self.to_file(point))?,
                        _ => collector.skipped.invalid += 1,
                    }
                }
                Ok(())
            }
        }
    }
}

/// From range, azimuth and elevation.
#[inline]
fn to_cartesian([range, azimuth, elevation]: [f64; 3]) -> [f64; 3] {
    let across = range * elevation.cos();
    [across * azimuth.cos(), across * azimuth.sin(), range * elevation.sin()]
}

/// One field of the records.
struct Field {
    /// Which byte stream of a packet carries it.
    stream: usize,
    /// Bits of a value; none if all values are the same.
    bits: u32,
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
    fn new(stream: usize, data_type: &RecordDataType) -> Self {
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
struct Stream<'a> {
    field: &'a Field,
    /// Byte of the whole stream that must come next.
    next_byte: u64,
    bytes: Vec<u8>,
    /// Bits of `bytes` already unpacked.
    bit: u64,
    values: Vec<f64>,
}

impl<'a> Stream<'a> {
    /// Wait for record `first`.
    fn new(field: &'a Field, first: u64) -> Self {
        let bit = first * u64::from(field.bits);
        Self { field, next_byte: bit / 8, bytes: vec![0; PADDING], bit: bit % 8, values: Vec::new() }
    }

    /// Take over the piece that begins at byte `before` of the whole stream, or what is new in it.
    fn append(&mut self, piece: &[u8], before: u64) {
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
    fn available(&self) -> u64 {
        let bits = (self.bytes.len() - PADDING) as u64 * 8 - self.bit;
        bits.checked_div(u64::from(self.field.bits)).unwrap_or(u64::MAX)
    }

    /// Unpack `count` values, which are available.
    fn unpack(&mut self, count: usize) {
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
                self.values.extend((0..count).map(|_| {
                    let (byte, shift) = ((bit / 8) as usize, bit % 8);
                    bit += u64::from(bits);
                    let low = u64_at(&self.bytes, byte) >> shift;
                    if u64::from(bits) + shift <= 64 {
                        return value(low);
                    }
                    value(low | u64::from(self.bytes[byte + 8]) << (64 - shift))
                }));
            }
        }
        self.bit += count as u64 * u64::from(self.field.bits);
    }
}

/// The file without its checksums, each of which is verified.
struct Pages<'a> {
    input: &'a Input,
    page_size: u64,
    /// Physical bytes to read together.
    ahead: u64,
    physical: Vec<u8>,
    /// What is at hand, from logical byte `first` on.
    window: Vec<u8>,
    first: u64,
}

impl<'a> Pages<'a> {
    fn new(input: &'a Input, page_size: u64, ahead: u64) -> Self {
        Self { input, page_size, ahead, physical: Vec::new(), window: Vec::new(), first: 0 }
    }

    /// The logical place of a physical one.
    fn logical(&self, physical: u64) -> Result<u64> {
        let (page, within) = (physical / self.page_size, physical % self.page_size);
        if physical >= self.input.len() || within >= self.page_size - CHECKSUM {
            return Err(self.input.bad(format!("expected points at byte {physical}, which is not in the file")));
        }
        Ok(page * (self.page_size - CHECKSUM) + within)
    }

    /// `length` logical bytes from `at` on.
    fn get(&mut self, at: u64, length: usize) -> Result<&[u8]> {
        let end = at + length as u64;
        if at < self.first || end > self.first + self.window.len() as u64 {
            self.load(at, end)?;
        }
        let start = (at - self.first) as usize;
        Ok(&self.window[start..start + length])
    }

    /// Read and verify the pages around `at..end` and some more.
    fn load(&mut self, at: u64, end: u64) -> Result<()> {
        let payload = self.page_size - CHECKSUM;
        let all = self.input.len() / self.page_size;
        let (from, needed) = (at / payload, end.div_ceil(payload));
        if needed > all {
            return Err(self.input.bad("the file ends within its points; it is cut short"));
        }
        let to = needed.max(from + self.ahead / self.page_size).min(all);
        self.input.read_into(from * self.page_size, (to - from) * self.page_size, &mut self.physical)?;
        self.window.clear();
        self.first = from * payload;
        for (page, bytes) in (from..).zip(self.physical.chunks_exact(self.page_size as usize)) {
            let (data, checksum) = bytes.split_at(payload as usize);
            if crc32c::crc32c(data).to_be_bytes() != checksum {
                self.window.clear();
                return Err(self.input.bad(format!("the checksum of page {page} is wrong; the file is damaged")));
            }
            self.window.extend_from_slice(data);
        }
        Ok(())
    }
}

/// The rotation matrix (columns one after the other) and the translation that lead to the file's frame.
fn pose(pc: &PointCloud) -> ([f64; 9], [f64; 3]) {
    let Some(transform) = &pc.transform else { return (IDENTITY, [0.0; 3]) };
    let (q, t) = (&transform.rotation, &transform.translation);
    let (w, x, y, z) = (q.w, q.x, q.y, q.z);
    let rotation = [
        w * w + x * x - y * y - z * z,
        2.0 * (x * y + w * z),
        2.0 * (x * z - w * y),
        2.0 * (x * y - w * z),
        w * w + y * y - x * x - z * z,
        2.0 * (y * z + w * x),
        2.0 * (x * z + w * y),
        2.0 * (y * z - w * x),
        w * w + z * z - x * x - y * y,
    ];
    (rotation, [t.x, t.y, t.z])
}

const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// A scan's GUID; where there is none, or several scans share it, with what else tells them apart.
fn key(pc: &PointCloud, is_shared: bool) -> String {
    let guid = pc.guid.as_deref().map(str::trim).unwrap_or_default();
    if !guid.is_empty() && !is_shared {
        return guid.to_owned();
    }
    let mut hash = Fnv::new();
    hash.update(name(pc).as_bytes());
    let (rotation, translation) = pose(pc);
    rotation.iter().chain(&translation).for_each(|v| hash.update(&v.to_le_bytes()));
    hash.update(&pc.records.to_le_bytes());
    format!("e57:{guid}{:016x}", hash.0)
}

/// What to call a scan in a message.
fn name(pc: &PointCloud) -> &str {
    pc.name.as_deref().or(pc.guid.as_deref()).unwrap_or("without name")
}

/// The box around all scans, if each has one.
fn bounds(clouds: &[Cloud]) -> Option<[[f64; 3]; 2]> {
    clouds.iter().map(|cloud| cloud.bounds).reduce(|one, other| {
        let ([low, high], [other_low, other_high]) = (one?, other?);
        Some([[0, 1, 2].map(|i| low[i].min(other_low[i])), [0, 1, 2].map(|i| high[i].max(other_high[i]))])
    })?
}

fn bad_e57(input: &Input, error: e57::Error) -> Error {
    let message = error.to_string().replace('\n', " ");
    match error {
        e57::Error::NotImplemented { .. } => Error::unsupported(input.path(), message),
        _ => input.bad(message),
    }
}
