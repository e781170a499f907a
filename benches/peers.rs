//! What the readers are measured against, and the E57 files to measure on: the `e57` and `laz` crates, as they come.
//!
//! ```text
//! peers e57 FILE           decode all points by the raw iterator
//! peers laz FILE           decode all points, a chunk at a time
//! peers write KIND RAW OUT an E57 of the float64 x, y, z in RAW, with intensity and colour as scanners write them;
//!                          KIND is float64, float32 or scaled
//! ```

use std::error::Error;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};

use e57::{E57Reader, E57Writer, Record, RecordDataType, RecordName, RecordValue};
use laz::{LasZipDecompressor, LazVlr};

/// Points of a scan in the files that are written: one setup of the generated floor.
const SCAN: usize = 2_500_000;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let sum = match words.as_slice() {
        ["e57", file] => decode_e57(file)?,
        ["laz", file] => decode_laz(file)?,
        ["write", kind, raw, out] => write_e57(kind, raw, out)?,
        _ => return Err("expected: peers e57 FILE, peers laz FILE, or peers write KIND RAW OUT".into()),
    };
    println!("{sum}");
    Ok(())
}

/// The first value of each point, summed up so that nothing is optimised away.
fn decode_e57(file: &str) -> Result<f64, Box<dyn Error>> {
    let mut reader = E57Reader::from_file(file)?;
    let mut sum = 0.0;
    for cloud in reader.pointclouds() {
        for point in reader.pointcloud_raw(&cloud)? {
            sum += match point?[0] {
                RecordValue::Double(x) => x,
                RecordValue::Single(x) => f64::from(x),
                RecordValue::ScaledInteger(x) | RecordValue::Integer(x) => x as f64,
            };
        }
    }
    Ok(sum)
}

fn decode_laz(file: &str) -> Result<f64, Box<dyn Error>> {
    let mut input = BufReader::new(File::open(file)?);
    let mut head = [0; 375];
    input.read_exact(&mut head)?;
    let number = |at: usize, bytes: usize| (0..bytes).rev().fold(0, |n, i| n << 8 | u64::from(head[at + i]));
    let (header, start, records) = (number(94, 2), number(96, 4), number(100, 4));
    let (length, legacy, points) = (number(105, 2) as usize, number(107, 4), number(247, 8));
    let mut left = if head[25] == 4 && points > 0 { points } else { legacy };
    let (mut at, mut laszip) = (header, Vec::new());
    for _ in 0..records {
        let mut record = [0; 54];
        input.seek(SeekFrom::Start(at))?;
        input.read_exact(&mut record)?;
        let size = u16::from_le_bytes([record[20], record[21]]);
        if record[2..].starts_with(b"laszip encoded") {
            laszip = vec![0; usize::from(size)];
            input.read_exact(&mut laszip)?;
        }
        at += 54 + u64::from(size);
    }
    let vlr = LazVlr::from_buffer(&laszip)?;
    let chunk = u64::from(vlr.chunk_size());
    input.seek(SeekFrom::Start(start))?;
    let mut decoder = LasZipDecompressor::new(input, vlr)?;
    let (mut buffer, mut sum) = (Vec::new(), 0.0);
    while left > 0 {
        let count = left.min(chunk);
        buffer.resize(count as usize * length, 0);
        decoder.decompress_many(&mut buffer)?;
        for record in buffer.chunks_exact(length) {
            sum += f64::from(i32::from_le_bytes([record[0], record[1], record[2], record[3]]));
        }
        left -= count;
    }
    Ok(sum)
}

fn write_e57(kind: &str, raw: &str, out: &str) -> Result<f64, Box<dyn Error>> {
    let data_type = match kind {
        "float64" => RecordDataType::Double { min: None, max: None },
        "float32" => RecordDataType::Single { min: None, max: None },
        "scaled" => RecordDataType::ScaledInteger { min: -10_000_000, max: 10_000_000, scale: 1e-4, offset: 0.0 },
        _ => return Err("expected float64, float32 or scaled".into()),
    };
    let names = [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ];
    let value = |v: f64| match kind {
        "float64" => RecordValue::Double(v),
        "float32" => RecordValue::Single(v as f32),
        _ => RecordValue::ScaledInteger((v * 1e4).round() as i64),
    };
    let mut input = BufReader::with_capacity(1 << 20, File::open(raw)?);
    let points = input.get_ref().metadata()?.len() as usize / 24;
    let mut writer = E57Writer::from_file(out, "{floor}")?;
    for first in (0..points).step_by(SCAN) {
        let place = names.iter().map(|name| Record { name: name.clone(), data_type: data_type.clone() });
        let looks = [Record::INTENSITY_UNIT_F32, Record::COLOR_RED_U8, Record::COLOR_GREEN_U8, Record::COLOR_BLUE_U8];
        let prototype = place.chain(looks).collect();
        let mut scan = writer.add_pointcloud(&format!("{{scan {}}}", first / SCAN), prototype)?;
        for _ in first..points.min(first + SCAN) {
            let mut bytes = [0; 24];
            input.read_exact(&mut bytes)?;
            let axis = |i: usize| f64::from_le_bytes(std::array::from_fn(|k| bytes[8 * i + k]));
            let grey = || RecordValue::Integer(i64::from(bytes[0]));
            let looks = [RecordValue::Single(f32::from(bytes[0]) / 255.0), grey(), grey(), grey()];
            scan.add_point((0..3).map(|i| value(axis(i))).chain(looks).collect())?;
        }
        scan.finalize()?;
    }
    writer.finalize()?;
    Ok(points as f64)
}
