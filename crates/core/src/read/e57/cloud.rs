//! The points of one scan: its packets, found once, and its records, decoded from anywhere.

use std::iter::empty;
use std::ops::Range;
use std::sync::OnceLock;

use e57::{PointCloud, RecordName};

use super::super::input::{Input, u16_at, u64_at};
use super::super::{BATCH, Collector};
use super::pages::Pages;
use super::stream::{Field, Stream};
use super::{IDENTITY, name, pose};
use crate::{Error, Result};

/// The points of one scan: where their fields are and how they become coordinates.
pub(super) struct Cloud {
    records: u64,
    /// Byte streams in each packet, ours and those we pass over.
    streams: usize,
    /// x, y, z or range, azimuth, elevation, and the invalid state where there is one.
    fields: Vec<Field>,
    spherical: bool,
    rotation: [f64; 9],
    translation: [f64; 3],
    pub position: Option<[f64; 3]>,
    pub bounds: Option<[[f64; 3]; 2]>,
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
    pub fn new(input: &Input, pc: &PointCloud) -> Result<Option<Self>> {
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
    pub fn read(&self, pages: &mut Pages<'_>, records: Range<u64>, collector: &mut Collector<'_>) -> Result<()> {
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
