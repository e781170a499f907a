//! Columns of numbers: XYZ, TXT, CSV, ASC and PTS. What stands between the columns, which of them are x, y, z, and
//! whether a comma is a decimal point is found out from the first lines.

use super::input::Input;
use super::lines::{Columns, Lines, byte_part, byte_parts, read_points};
use super::{Batch, Collector, Header, Scan, Skipped, Source};
use crate::{Error, Result};

/// Bytes at the start from which the columns are found out.
const SAMPLE: usize = 64 * 1024;

/// What people call x, y and z, in lower case, without units.
const NAMES: [&[&str]; 3] = [
    &["x", "east", "easting", "e", "cartesianx", "x_coord", "xcoord", "coord_x", "pos_x", "rechtswert"],
    &["y", "north", "northing", "n", "cartesiany", "y_coord", "ycoord", "coord_y", "pos_y", "hochwert"],
    &["z", "height", "elevation", "h", "cartesianz", "z_coord", "zcoord", "coord_z", "pos_z", "altitude", "alt"],
];

/// An opened text file.
pub(super) struct Text {
    input: Input,
    header: Header,
    columns: Columns,
    /// Lines with a single number are the numbers of points that follow (PTS).
    has_counts: bool,
    /// Where the first row of numbers begins.
    start: u64,
}

impl Text {
    /// Find out what the columns are. `format` is the name to show.
    pub fn open(input: Input, format: &str) -> Result<Self> {
        let sample = input.head(SAMPLE)?;
        check_text(&input, &sample, format)?;
        let bom = if sample.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        let is_whole = sample.len() as u64 == input.len();
        let rows = Row::split(&sample, bom, is_whole);
        let layout = Layout::find(&input, &rows, format == "PTS")?;
        let key = format!("{}:{}", format.to_lowercase(), input.content_key(0)?);
        let header = Header {
            format: format!("{format}, {}", layout.describe()),
            points: layout.count,
            scans: vec![Scan { number: 0, key: key.clone(), name: None, position: None, points: layout.count }],
            key,
            notes: layout.notes,
            ..Header::default()
        };
        if let Some(count) = layout.count
            && count > input.len() / 6
        {
            return Err(input.bad(format!(
                "its first line promises {count} points, more than {} bytes can hold; it is cut short",
                input.len()
            )));
        }
        Ok(Self { input, header, columns: layout.columns, has_counts: layout.has_counts, start: layout.start })
    }
}

impl Source for Text {
    fn header(&self) -> &Header {
        &self.header
    }

    fn parts(&self) -> usize {
        byte_parts(self.start..self.input.len())
    }

    fn read(&self, part: usize, sink: &mut dyn FnMut(&Batch) -> Result<()>) -> Result<Skipped> {
        let mut collector = Collector::new(0, sink);
        let range = byte_part(self.start..self.input.len(), part);
        let lines = Lines::within(&self.input, range, self.start)?;
        let is_count = |line: &[u8]| self.has_counts && line.trim_ascii().iter().all(u8::is_ascii_digit);
        let is_other = |line: &[u8]| is_comment(line) || is_count(line);
        read_points(&self.input, lines, &self.columns, &mut collector, |p, collector| collector.push(p), is_other)?;
        collector.finish()
    }
}

/// Refuse what is not text in an encoding whose digits are ASCII.
pub(super) fn check_text(input: &Input, sample: &[u8], format: &str) -> Result<()> {
    if sample.starts_with(b"\xff\xfe") || sample.starts_with(b"\xfe\xff") {
        return Err(Error::unsupported(input.path(), "expected UTF-8 text, found UTF-16; save it as UTF-8"));
    }
    if sample.contains(&0) {
        return Err(input.bad(format!("expected {format} text, found binary data")));
    }
    Ok(())
}

fn is_comment(line: &[u8]) -> bool {
    let line = line.trim_ascii_start();
    matches!(line.first(), Some(b'#' | b'%' | b'!')) || line.starts_with(b"//")
}

/// A line of the sample.
struct Row<'a> {
    start: u64,
    text: &'a str,
}

impl<'a> Row<'a> {
    /// The lines of the sample that are not blank; a last one that the sample cuts off is left out.
    fn split(sample: &'a [u8], first: usize, is_whole: bool) -> Vec<Self> {
        let (mut rows, mut start) = (Vec::new(), first);
        for line in sample[first..].split_inclusive(|&byte| byte == b'\n') {
            // Words may be in any encoding: only ASCII matters.
            let text = match std::str::from_utf8(line) {
                Ok(text) => text,
                Err(error) => std::str::from_utf8(&line[..error.valid_up_to()]).unwrap_or_default(),
            };
            if !text.trim().is_empty() && (line.ends_with(b"\n") || is_whole) {
                rows.push(Self { start: start as u64, text: text.trim() });
            }
            start += line.len();
        }
        rows
    }

    /// Whether it is a row of points: three numbers or more among whatever else.
    fn is_point(&self) -> bool {
        let words = self.text.split(|c: char| c.is_whitespace() || ";,|\"".contains(c));
        !is_comment(self.text.as_bytes()) && words.filter(|word| word.parse::<f64>().is_ok()).count() >= 3
    }

    /// Whether it is a number of points.
    fn is_count(&self) -> bool {
        !self.text.is_empty() && self.text.bytes().all(|byte| byte.is_ascii_digit())
    }

    fn split_at(&self, delimiter: Option<u8>) -> Vec<&'a str> {
        match delimiter {
            Some(byte) => self.text.split(char::from(byte)).map(|word| word.trim_matches([' ', '"'])).collect(),
            None => self.text.split_whitespace().map(|word| word.trim_matches('"')).collect(),
        }
    }
}

/// What the first lines tell.
struct Layout {
    columns: Columns,
    xyz: [usize; 3],
    start: u64,
    has_counts: bool,
    count: Option<u64>,
    notes: Vec<String>,
}

impl Layout {
    fn find(input: &Input, rows: &[Row<'_>], is_pts: bool) -> Result<Self> {
        let Some(first_row) = rows.iter().find(|row| row.is_point() || row.is_count()) else {
            let shown: String = rows.first().map_or("nothing", |row| row.text).chars().take(40).collect();
            return Err(input.bad(format!("expected rows of x, y, z, found {shown:?}")));
        };
        if rows.iter().any(|row| row.text.to_ascii_lowercase().starts_with("ncols")) {
            return Err(Error::unsupported(input.path(), "expected rows of x, y, z, found a raster (ESRI ASCII grid)"));
        }
        let mut layout = Self {
            columns: Columns::new([0, 1, 2], None, false),
            xyz: [0, 1, 2],
            start: first_row.start,
            has_counts: first_row.is_count(),
            count: first_row.text.parse().ok(),
            notes: Vec::new(),
        };
        let points: Vec<_> = rows.iter().filter(|row| row.is_point()).collect();
        let Some(first) = points.first() else {
            // Only a count: fine if it is zero, and found wanting later if it is not.
            return Ok(layout);
        };
        let delimiter = find_delimiter(first.text);
        let decimal_comma = delimiter != Some(b',') && first.text.contains(',');
        let words = first.split_at(delimiter);
        if words.len() < 3 {
            return Err(input.bad(format!("expected three columns or more, found {:?}", first.text)));
        }
        let above = rows.iter().take_while(|row| !row.is_point());
        let named = above.filter_map(|row| find_names(row, delimiter, words.len())).last();
        if let Some(names) = named {
            let [Some(x), Some(y), Some(z)] = find_axes(&names) else {
                return Err(input.bad(format!("expected columns x, y, z, found {}", names.join(", "))));
            };
            layout.xyz = [x, y, z];
        } else if !is_pts && !layout.has_counts && is_numbered(&points, delimiter) {
            layout.xyz = [1, 2, 3];
            layout.notes.push("its first column numbers the rows: x, y, z are columns 2, 3, 4".into());
        }
        layout.columns = Columns::new(layout.xyz, delimiter, decimal_comma);
        Ok(layout)
    }

    fn describe(&self) -> String {
        let delimiter = match self.columns.delimiter {
            None => "blanks".to_owned(),
            Some(b'\t') => "tabs".to_owned(),
            Some(byte) => format!("{:?}", char::from(byte)),
        };
        let comma = if self.columns.decimal_comma { ", decimal commas" } else { "" };
        let [x, y, z] = self.xyz.map(|column| column + 1);
        format!("columns {x}, {y}, {z} between {delimiter}{comma}")
    }
}

/// What stands between the columns; `None` for blanks. A comma between digits may be either: it is a decimal comma if
/// blanks already make three columns, none of which ends in one.
fn find_delimiter(line: &str) -> Option<u8> {
    if let Some(&byte) = [b';', b'|', b'\t'].iter().find(|&&byte| line.contains(char::from(byte))) {
        return Some(byte);
    }
    let words: Vec<_> = line.split_whitespace().collect();
    let is_decimal = |word: &str| word.matches(',').count() <= 1 && !word.ends_with(',') && !word.starts_with(',');
    if line.contains(',') && (words.len() < 3 || line.contains('.') || !words.iter().all(|word| is_decimal(word))) {
        return Some(b',');
    }
    None
}

/// The names in a line above the numbers: one for each column. A comment may say anything: it must name x, y, z.
fn find_names(row: &Row<'_>, delimiter: Option<u8>, columns: usize) -> Option<Vec<String>> {
    let line = Row { start: row.start, text: row.text.trim_start_matches(['#', '%', '!', '/', ' ']) };
    let mut names = line.split_at(delimiter);
    if names.len() != columns {
        names = line.split_at(None);
    }
    let plain = |name: &str| name.split(['[', '(']).next().unwrap_or_default().trim().to_ascii_lowercase();
    let names: Vec<_> = names.into_iter().map(plain).collect();
    let names_all = find_axes(&names).iter().all(Option::is_some);
    (names_all || (names.len() == columns && !is_comment(row.text.as_bytes()))).then_some(names)
}

/// The columns called x, y and z.
fn find_axes(names: &[String]) -> [Option<usize>; 3] {
    NAMES.map(|known| names.iter().position(|name| known.contains(&name.as_str())))
}

/// Whether the first of four or more columns counts the rows: 1, 2, 3, ...
fn is_numbered(rows: &[&Row<'_>], delimiter: Option<u8>) -> bool {
    let first = |row: &&&Row<'_>| row.split_at(delimiter)[0].parse::<u64>().ok();
    let has_four = rows.iter().all(|row| row.split_at(delimiter).len() >= 4);
    rows.len() >= 5 && has_four && {
        let Some(start) = rows.first().as_ref().and_then(first).filter(|&start| start <= 1) else { return false };
        rows.iter().zip(start..).all(|(row, expected)| first(&row) == Some(expected))
    }
}
