//! PTX: scans one after the other as grids of rows. Each begins with its size, the scanner's place and axes, and the
//! transform that leads to the common frame; `0 0 0` stands where nothing came back.

use std::ops::Range;

use super::input::{Fnv, Input};
use super::lines::{Columns, Lines, byte_part, byte_parts, read_points, skip_lines};
use super::text::check_text;
use super::{Batch, Collector, Header, Scan, Skipped, Source};
use crate::Result;

/// Lines before the points of a scan.
const HEADER_LINES: usize = 10;

/// The shortest line of a point: `0 0 0` and its end.
const SHORTEST_LINE: u64 = 6;

/// An opened PTX file.
pub(super) struct Ptx {
    input: Input,
    header: Header,
    /// Rows of the 4 x 4 transform of each scan; a point is a row vector to its left.
    transforms: Vec<[[f64; 3]; 4]>,
    /// Where the points of each scan begin, and where they end.
    places: Vec<Range<u64>>,
    /// Scan of each part, and which of the scan's it is.
    parts: Vec<(usize, usize)>,
}

impl Ptx {
    /// Find where the scans begin, which takes counting the lines of all of them, unless it is known where they end.
    pub fn open(input: Input, known: &[u64]) -> Result<Self> {
        check_text(&input, &input.head(1024)?, "PTX")?;
        let (mut transforms, mut places, mut parts, mut scans) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut at = 0;
        while let Some(setup) = Setup::read(&input, at)? {
            let number = scans.len();
            let cut_short = || {
                input.bad(format!(
                    "scan {} promises {} points, more than the file holds; it is cut short",
                    number + 1,
                    setup.points
                ))
            };
            // The last line may lack its end.
            if setup.points > (input.len() - setup.end + 1) / SHORTEST_LINE {
                return Err(cut_short());
            }
            let end = match known.get(number) {
                Some(&end) if (setup.end..=input.len()).contains(&end) => end,
                _ => skip_lines(&input, setup.end, setup.points)?.ok_or_else(cut_short)?,
            };
            let place = setup.end..end;
            parts.extend((0..byte_parts(place.clone())).map(|part| (number, part)));
            places.push(place);
            scans.push(Scan {
                number: number as u32,
                key: key(&input, at..end)?,
                name: None,
                position: Some(setup.transform[3]),
                points: Some(setup.points),
            });
            transforms.push(setup.transform);
            at = end;
        }
        let header = Header {
            format: "PTX".into(),
            points: Some(scans.iter().filter_map(|scan| scan.points).sum()),
            key: "ptx".into(),
            scans,
            ..Header::default()
        };
        Ok(Self { input, header, transforms, places, parts })
    }
}

impl Source for Ptx {
    fn header(&self) -> &Header {
        &self.header
    }

    fn parts(&self) -> usize {
        self.parts.len().max(1)
    }

    fn scan_ends(&self) -> Vec<u64> {
        self.places.iter().map(|place| place.end).collect()
    }

    fn read(&self, part: usize, sink: &mut dyn FnMut(&Batch) -> Result<()>) -> Result<Skipped> {
        let Some(&(scan, part)) = self.parts.get(part) else { return Ok(Skipped::default()) };
        let mut collector = Collector::new(scan as u32, sink);
        let [a, b, c, t] = self.transforms[scan];
        let convert = |[x, y, z]: [f64; 3], collector: &mut Collector<'_>| {
            if x == 0.0 && y == 0.0 && z == 0.0 {
                collector.skipped.invalid += 1;
                return Ok(());
            }
            let along = |i: usize| x * a[i] + y * b[i] + z * c[i] + t[i];
            collector.push([along(0), along(1), along(2)])
        };
        let columns = Columns::new([0, 1, 2], None, false);
        let place = &self.places[scan];
        let lines = Lines::within(&self.input, byte_part(place.clone(), part), place.start)?;
        read_points(&self.input, lines, &columns, &mut collector, convert, |_| false)?;
        collector.finish()
    }
}

/// What stands before the points of a scan.
struct Setup {
    points: u64,
    transform: [[f64; 3]; 4],
    /// Where the points begin.
    end: u64,
}

impl Setup {
    /// The setup at `at`, or `None` if only blank lines follow.
    fn read(input: &Input, at: u64) -> Result<Option<Self>> {
        let mut lines = Lines::new(input, at..input.len());
        let mut rows: Vec<Vec<f64>> = Vec::new();
        while rows.len() < HEADER_LINES {
            let Some(line) = lines.next()? else { break };
            let (place, text) = (line.at, String::from_utf8_lossy(line.text()));
            if text.trim().is_empty() && rows.is_empty() {
                continue;
            }
            let numbers: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
            let expected = [1, 1, 3, 3, 3, 3, 4, 4, 4, 4][rows.len()];
            let numbers = numbers.filter(|n| n.len() == expected && n.iter().all(|v| v.is_finite()));
            let Some(numbers) = numbers else {
                let what =
                    ["columns", "rows", "position", "axis", "axis", "axis"].get(rows.len()).unwrap_or(&"transform");
                let shown: String = text.chars().take(40).collect();
                return Err(input.bad(format!(
                    "expected the {what} of scan setup ({expected} numbers) at byte {place}, found {shown:?}"
                )));
            };
            rows.push(numbers);
        }
        if rows.is_empty() {
            return Ok(None);
        }
        if rows.len() < HEADER_LINES {
            return Err(input.bad("the file ends within the header of a scan; it is cut short"));
        }
        let (columns, rows_of_scan) = (rows[0][0], rows[1][0]);
        let is_count = |v: f64| v >= 0.0 && v.fract() == 0.0 && v < 1e9;
        if !is_count(columns) || !is_count(rows_of_scan) {
            return Err(input.bad(format!("expected numbers of columns and rows, found {columns} and {rows_of_scan}")));
        }
        let transform = [6, 7, 8, 9].map(|i| [rows[i][0], rows[i][1], rows[i][2]]);
        Ok(Some(Self { points: columns as u64 * rows_of_scan as u64, transform, end: lines.position() }))
    }
}

/// A key made from a scan's header and first points, wherever in whichever file it stands.
fn key(input: &Input, scan: Range<u64>) -> Result<String> {
    let (mut bytes, mut hash) = (Vec::new(), Fnv::new());
    input.read_into(scan.start, (scan.end - scan.start).min(64 * 1024), &mut bytes)?;
    hash.update(&bytes);
    hash.update(&(scan.end - scan.start).to_le_bytes());
    Ok(format!("ptx:{:016x}", hash.0))
}
