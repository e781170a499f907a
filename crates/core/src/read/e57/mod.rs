//! E57 (ASTM E2807): several scans with poses, Cartesian or spherical, as floats, doubles or scaled integers.
//!
//! The `e57` crate reads the header and the XML. The points are decoded here, since it boxes each value: a scan is
//! a run of packets, each of which carries a piece of one byte stream per field. The pieces of a stream, laid end
//! to end, are its values, bit after bit; so record n of a field of b bits begins at bit n b, and a scan can be
//! entered anywhere once its packets are indexed. Every page's checksum is verified.

mod cloud;
mod pages;
mod stream;

use std::ops::Range;

use e57::{E57Reader, PointCloud};

use self::cloud::Cloud;
use self::pages::Pages;
use super::input::{Fnv, Input, u32_at, u64_at};
use super::{Batch, Collector, Header, PART, Scan, Skipped, Source, guarded};
use crate::{Error, Result};

/// Physical bytes that are read and verified together.
const WINDOW: u64 = 1 << 20;

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
