//! LAS 1.0 to 1.4, plain and compressed (LAZ, COPC). The public header and the records are read in
//! place: x, y, z are i32 x scale + offset in f64, so that survey coordinates lose nothing.

use super::copc;
use super::input::{Fnv, Input, array, f64_at, i32_at, u16_at, u32_at, u64_at};
use super::laz::Laz;
use super::{BATCH, Batch, Collector, Header, PART, READ, Skipped, Source};
use crate::{Error, Result};

/// Bytes of a point record of format 0 to 10, without extra bytes.
const RECORD_LENGTHS: [u16; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

/// Longest WKT that is believed.
const LONGEST_CRS: u64 = 1 << 20;

/// An opened LAS or LAZ file.
pub(super) struct Las {
    input: Input,
    header: Header,
    layout: Layout,
    laz: Option<Laz>,
}

/// Where the points are and how a record becomes coordinates.
pub(super) struct Layout {
    /// Byte at which the points (LAZ: the offset of the chunk table) begin.
    pub start: u64,
    /// Points in the file.
    pub points: u64,
    /// Bytes of an uncompressed record.
    pub record_length: usize,
    /// Byte of the point source id within a record.
    source_id_at: usize,
    scale: [f64; 3],
    offset: [f64; 3],
}

impl Layout {
    /// x, y, z of a record.
    #[inline]
    fn point(&self, record: &[u8]) -> [f64; 3] {
        let raw: [u8; 12] = array(record, 0); // its length is checked once
        let axis = |i: usize| f64::from(i32_at(&raw, 4 * i)) * self.scale[i] + self.offset[i];
        [axis(0), axis(1), axis(2)]
    }

    /// Hand on the points of some records.
    pub fn hand_on(&self, records: &[u8], collector: &mut Collector<'_>) -> Result<()> {
        records.chunks(self.record_length * BATCH).try_for_each(|batch| self.hand_on_batch(batch, collector))
    }

    #[inline]
    fn hand_on_batch(&self, records: &[u8], collector: &mut Collector<'_>) -> Result<()> {
        let records = || records.chunks_exact(self.record_length);
        let (points, mut scans) = (records().map(|r| self.point(r)), records().map(|r| self.scan(r)));
        let first = scans.next().unwrap_or_default();
        if scans.fold(true, |all, scan| all & (scan == first)) {
            collector.batch.scan = first;
            return collector.extend(points, std::iter::empty());
        }
        collector.extend(points, records().map(|r| self.scan(r)))
    }

    /// The point source id of a record.
    #[inline]
    fn scan(&self, record: &[u8]) -> u32 {
        u32::from(u16_at(record, self.source_id_at))
    }
}

impl Las {
    /// Read the public header and the variable length records. With a `spacing`, a COPC file gives only the levels
    /// of its octree down to points that close together, in its own unit.
    pub fn open(input: Input, spacing: Option<f64>) -> Result<Self> {
        let head = input.head(375)?;
        if head.len() < 227 {
            return Err(input.bad(format!("expected a LAS header of 227 bytes, found {} bytes", head.len())));
        }
        let (major, minor) = (head[24], head[25]);
        if major != 1 || minor > 4 {
            let message = format!("expected LAS 1.0 to 1.4, found LAS {major}.{minor}; convert it to LAS 1.4");
            return Err(Error::unsupported(input.path(), message));
        }
        let header_length = u16_at(&head, 94);
        if minor == 4 && head.len() < 375 {
            return Err(input.bad("the file ends within its header; it is cut short"));
        }
        let start = u64::from(u32_at(&head, 96));
        // LASzip marks compressed points in the two upper bits of the format.
        let (compressed, format) = (head[104] & 0xc0 != 0, head[104] & 0x3f);
        let record_length = u16_at(&head, 105);
        let Some(&least) = RECORD_LENGTHS.get(usize::from(format)) else {
            let message = format!("expected point format 0 to 10, found {format}");
            return Err(Error::unsupported(input.path(), message));
        };
        if record_length < least {
            return Err(input.bad(format!(
                "expected records of {least} bytes or more (point format {format}), found {record_length}"
            )));
        }
        let legacy = u64::from(u32_at(&head, 107));
        let points = if minor == 4 && u64_at(&head, 247) > 0 { u64_at(&head, 247) } else { legacy };
        let three = |at: usize| [f64_at(&head, at), f64_at(&head, at + 8), f64_at(&head, at + 16)];
        let (scale, offset) = (three(131), three(155));
        if scale.iter().any(|s| !s.is_finite() || *s == 0.0) || offset.iter().any(|o| !o.is_finite()) {
            return Err(input.bad(format!("expected finite scales and offsets, found {scale:?} and {offset:?}")));
        }
        if start > input.len() || u64::from(header_length) > start {
            return Err(input.bad(format!(
                "the points begin at byte {start} of {}; the file is cut short or damaged",
                input.len()
            )));
        }

        let evlrs = if minor == 4 { (u64_at(&head, 235), u32_at(&head, 243)) } else { (0, 0) };
        let records = Records::read(&input, u64::from(header_length), u32_at(&head, 100), start, evlrs)?;
        let source_id_at = if format < 6 { 18 } else { 20 };
        let layout = Layout { start, points, record_length: usize::from(record_length), source_id_at, scale, offset };
        let nodes = match (spacing, &records.copc) {
            (Some(spacing), Some(info)) => Some(copc::nodes(&input, &layout, info, spacing)?),
            _ => None,
        };
        let read = nodes.as_ref().map_or(points, |nodes| nodes.iter().map(|node| node.points).sum());
        let notes = (read < points).then(|| format!("preview: {read} of {points} points, evenly spread"));
        let laz = match (compressed, &records.laszip) {
            (false, _) => None,
            (true, Some(record)) if points > 0 => Some(Laz::open(&input, &layout, record, nodes)?),
            (true, Some(_)) => None,
            (true, None) => return Err(input.bad("expected a LASzip record for its compressed points, found none")),
        };
        if !compressed {
            let held = (input.len() - start) / u64::from(record_length);
            if held < points {
                return Err(
                    input.bad(format!("the header promises {points} points, the file holds {held}; it is cut short"))
                );
            }
        }
        let packing = match (compressed, records.copc.is_some()) {
            (_, true) => ", COPC",
            (true, false) => ", LAZ",
            (false, false) => "",
        };
        let [max_x, min_x, max_y, min_y, max_z, min_z] = [0, 1, 2, 3, 4, 5].map(|i| f64_at(&head, 179 + 8 * i));
        let bounds = [[min_x, min_y, min_z], [max_x, max_y, max_z]];
        let header = Header {
            format: format!("LAS {major}.{minor}, point format {format}{packing}"),
            points: Some(read),
            bounds: (points > 0 && bounds.iter().flatten().all(|v| v.is_finite())).then_some(bounds),
            scans: Vec::new(),
            key: scan_key(&head),
            crs: records.crs,
            notes: records.notes.into_iter().chain(notes).collect(),
        };
        Ok(Self { input, header, layout, laz })
    }
}

/// A point source id is unique within a project (LAS 1.4, table 7), which the GUID in the header names. Without
/// one, the header itself (counts, bounds, dates) tells files apart that number their scans alike.
fn scan_key(head: &[u8]) -> String {
    let guid = &head[8..24];
    if guid.iter().any(|&b| b != 0) {
        return format!("las:{:032x}", u128::from_le_bytes(array(guid, 0)));
    }
    let mut hash = Fnv::new();
    hash.update(head);
    format!("las:{:016x}", hash.0)
}

impl Source for Las {
    fn header(&self) -> &Header {
        &self.header
    }

    fn parts(&self) -> usize {
        match &self.laz {
            Some(laz) => laz.parts(),
            None => usize::try_from(self.layout.points.div_ceil(PART)).unwrap_or(usize::MAX).max(1),
        }
    }

    fn read(&self, part: usize, sink: &mut dyn FnMut(&Batch) -> Result<()>) -> Result<Skipped> {
        let mut collector = Collector::new(0, sink);
        match &self.laz {
            Some(laz) => laz.read(&self.input, &self.layout, part, &mut collector)?,
            None => {
                let layout = &self.layout;
                let end = ((part as u64 + 1) * PART).min(layout.points);
                let mut buffer = Vec::new();
                for first in (part as u64 * PART..end).step_by(READ) {
                    let (from, count) = (first * layout.record_length as u64, (end - first).min(READ as u64));
                    self.input.read_into(layout.start + from, count * layout.record_length as u64, &mut buffer)?;
                    layout.hand_on(&buffer, &mut collector)?;
                }
            }
        }
        collector.finish()
    }
}

/// What the variable length records tell.
#[derive(Default)]
struct Records {
    laszip: Option<Vec<u8>>,
    copc: Option<Vec<u8>>,
    crs: Option<String>,
    notes: Vec<String>,
}

impl Records {
    /// Walk the records between the header and the points, then the extended ones behind the points.
    fn read(input: &Input, header_length: u64, count: u32, start: u64, evlrs: (u64, u32)) -> Result<Self> {
        let (mut records, mut geo_keys) = (Self::default(), Vec::new());
        let (mut at, mut head, mut data) = (header_length, [0; 60], Vec::new());
        for _ in 0..count {
            if at + 54 > start {
                return Err(input.bad(format!("expected {count} variable length records before byte {start}")));
            }
            input.read_at(at, &mut head[..54])?;
            let length = u64::from(u16_at(&head, 20));
            if at + 54 + length > start {
                return Err(input.bad("a variable length record runs into the points"));
            }
            input.read_into(at + 54, length, &mut data)?;
            records.take(&head, &data, &mut geo_keys);
            at += 54 + length;
        }
        let (mut at, count) = evlrs;
        for _ in 0..count {
            // A damaged tail costs the coordinate system, not the points.
            if at < start || at.checked_add(60).is_none_or(|end| end > input.len()) {
                break;
            }
            input.read_at(at, &mut head)?;
            let length = u64_at(&head, 20);
            let Some(next) = at.checked_add(60).and_then(|at| at.checked_add(length)) else { break };
            if next > input.len() {
                break;
            }
            if length <= LONGEST_CRS {
                input.read_into(at + 60, length, &mut data)?;
                records.take(&head, &data, &mut geo_keys);
            }
            at = next;
        }
        if records.crs.is_none() {
            records.take_geo_keys(&geo_keys);
        }
        Ok(records)
    }

    /// Keep a record that says something about the points.
    fn take(&mut self, head: &[u8], data: &[u8], geo_keys: &mut Vec<u8>) {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim_matches(['\0', ' ', '\n']).to_string();
        match (text(&head[2..18]).as_str(), u16_at(head, 18)) {
            ("laszip encoded", 22204) => self.laszip = Some(data.to_vec()),
            ("copc", 1) => self.copc = Some(data.to_vec()),
            ("LASF_Projection", 2112) => self.crs = Some(text(data)).filter(|wkt| !wkt.is_empty()),
            ("LASF_Projection", 34735) => *geo_keys = data.to_vec(),
            _ => {}
        }
    }

    /// The EPSG code and the unit that GeoTIFF keys name: four u16 each, after a header of four.
    fn take_geo_keys(&mut self, directory: &[u8]) {
        let (mut projected, mut geographic) = (None, None);
        for entry in directory.chunks_exact(8).skip(1) {
            let (key, location, value) = (u16_at(entry, 0), u16_at(entry, 2), u16_at(entry, 6));
            let is_code = location == 0 && value != 0 && value != 32767;
            match key {
                3072 if is_code => projected = Some(value),
                2048 if is_code => geographic = Some(value),
                3076 if matches!(value, 9002 | 9003) => {
                    self.notes.push("its coordinate system counts in feet: the points may need --unit ft".into());
                }
                _ => {}
            }
        }
        self.crs = projected.or(geographic).map(|code| format!("EPSG:{code}"));
    }
}
