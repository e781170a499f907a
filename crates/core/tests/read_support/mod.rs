//! What the tests of the readers share: fixtures, their points, and reading a file whole.

#![allow(dead_code, reason = "each test file uses some of it")]

use std::path::{Path, PathBuf};

use asbuilt_core::Result;
use asbuilt_core::read::{Header, Skipped, Source, open};

/// A point and the number of its scan.
pub type Point = ([f64; 3], u32);

/// A file that has been read whole.
pub struct Cloud {
    pub header: Header,
    pub points: Vec<Point>,
    pub skipped: Skipped,
}

/// Read all parts, the last one first: parts must not depend on each other.
pub fn read(path: &Path) -> Result<Cloud> {
    let source = open(path)?;
    let mut skipped = Skipped::default();
    let mut parts = Vec::new();
    for part in (0..source.parts()).rev() {
        let (points, left_out) = read_part(&*source, part)?;
        skipped.invalid += left_out.invalid;
        skipped.not_finite += left_out.not_finite;
        parts.push(points);
    }
    let points: Vec<_> = parts.into_iter().rev().flatten().collect();
    source.header().check(path, points.len() as u64 + skipped.invalid + skipped.not_finite)?;
    Ok(Cloud { header: source.header().clone(), points, skipped })
}

/// The points of one part.
pub fn read_part(source: &dyn Source, part: usize) -> Result<(Vec<Point>, Skipped)> {
    let mut points = Vec::new();
    let skipped = source.read(part, &mut |batch| {
        assert!(batch.scans.is_empty() || batch.scans.len() == batch.points.len());
        let scan = |i: usize| batch.scans.get(i).copied().unwrap_or(batch.scan);
        points.extend(batch.points.iter().enumerate().map(|(i, point)| (*point, scan(i))));
        Ok(())
    })?;
    Ok((points, skipped))
}

/// The folder of fixtures.
pub fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data")
}

/// A line of `fixtures.csv`.
pub struct Fixture {
    pub name: String,
    pub points: String,
    pub tolerance: f64,
}

/// All files that other programs wrote for these tests.
pub fn fixtures() -> Vec<Fixture> {
    let list = std::fs::read_to_string(data().join("fixtures.csv")).unwrap();
    let fixture = |line: &str| {
        let words: Vec<_> = line.split(',').collect();
        Fixture { name: words[0].into(), points: words[1].into(), tolerance: words[2].parse().unwrap() }
    };
    list.lines().skip(1).map(fixture).collect()
}

/// The points of that name: rows of x, y, z and perhaps a scan number. Some are given by a rule, as
/// `make_fixtures.py` has it.
pub fn expected(name: &str) -> Vec<Vec<f64>> {
    match name {
        "grid" => (0..100_050).map(|i| [i % 400, i / 400, 0, i / 50_025 + 1].map(f64::from).to_vec()).collect(),
        "packets" => {
            let own = |i: u32| [f64::from(i * 37 % 8191), f64::from(i * 101 % 4093), f64::from(i % 2503)];
            // Turned by 120 degrees about the diagonal: x to y to z to x.
            let posed = |[x, y, z]: [f64; 3]| vec![z * 0.001 - 3.0, x * 0.001 + 2.0, y * 0.001 + 1.5];
            (0..15_000).map(|i| posed(own(i))).collect()
        }
        _ => read_npy(&data().join(format!("{name}.npy"))),
    }
}

/// A two-dimensional array of little-endian doubles.
fn read_npy(path: &Path) -> Vec<Vec<f64>> {
    let bytes = std::fs::read(path).unwrap();
    let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let about = std::str::from_utf8(&bytes[10..10 + length]).unwrap();
    assert!(about.contains("'<f8'") && about.contains("'fortran_order': False"));
    let columns: usize = about.split("), }").next().unwrap().rsplit(", ").next().unwrap().parse().unwrap();
    let values: Vec<f64> =
        bytes[10 + length..].chunks_exact(8).map(|v| f64::from_le_bytes(v.try_into().unwrap())).collect();
    values.chunks_exact(columns).map(<[f64]>::to_vec).collect()
}

/// A path for a file of this test, in a folder that the build removes.
pub fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder.join(name)
}

/// A scratch file with this content.
pub fn write(name: &str, content: &[u8]) -> PathBuf {
    let path = scratch(name);
    std::fs::write(&path, content).unwrap();
    path
}

/// A fixed sequence of numbers that look random.
pub struct Numbers(pub u64);

impl Numbers {
    pub fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    pub fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Variants of each file: few enough for every day, or as many as `FUZZ_ROUNDS` says.
pub fn rounds(every_day: usize) -> usize {
    std::env::var("FUZZ_ROUNDS").ok().and_then(|rounds| rounds.parse().ok()).unwrap_or(every_day)
}
