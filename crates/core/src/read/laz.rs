//! Compressed points of LAS files, chunk by chunk. The `laz` crate decodes; what it would believe
//! (numbers of chunks, sizes of layers) is checked here against the file first.

use std::io::{BufReader, Cursor};
use std::ops::Range;

use laz::laszip::ChunkTable;
use laz::record::{LayeredPointRecordDecompressor, RecordDecompressor, SequentialPointRecordDecompressor};
use laz::{DecompressionSelection, LazItem, LazItemType, LazVlr};

use super::input::{Input, u32_at, u64_at};
use super::las::Layout;
use super::{Collector, PART, READ, guarded};
use crate::{Error, Result};

/// How the points of a file are compressed.
pub(super) struct Laz {
    items: Vec<LazItem>,
    /// Formats 6 to 10 keep each field in a layer of its own: those we do not need stay compressed.
    layered: bool,
    /// Points of a full chunk, for files without a table.
    chunk_size: u64,
    /// Empty where the file has no table and must be read from its start.
    chunks: Vec<Chunk>,
    /// Chunks of each part.
    parts: Vec<Range<usize>>,
}

/// Points that can be decoded without those before them.
pub(super) struct Chunk {
    pub start: u64,
    pub length: u64,
    pub points: u64,
}

impl Laz {
    /// Understand the LASzip record and the chunk table; or take only the `wanted` chunks, which are not empty.
    pub fn open(input: &Input, layout: &Layout, record: &[u8], wanted: Option<Vec<Chunk>>) -> Result<Self> {
        let vlr = LazVlr::from_buffer(record).map_err(|e| bad_laz(input, e))?;
        let items = vlr.items().clone();
        let item_size = items.iter().map(|item| usize::from(item.size())).sum::<usize>();
        let version = items.first().map_or(0, LazItem::version);
        let expected = if version < 3 { LazItemType::Point10 } else { LazItemType::Point14 };
        if items.first().is_none_or(|item| item.item_type() != expected) || item_size != layout.record_length {
            return Err(input.bad(format!(
                "expected a LASzip record for points of {} bytes, found one for {item_size} bytes",
                layout.record_length
            )));
        }
        // Also checks that this combination of fields and versions can be decoded.
        let layered = match version {
            1 | 2 => SequentialPointRecordDecompressor::new(&[] as &[u8]).set_fields_from(&items).map(|()| false),
            _ => LayeredPointRecordDecompressor::new(Cursor::new(&[] as &[u8])).set_fields_from(&items).map(|()| true),
        }
        .map_err(|e| bad_laz(input, e))?;
        let point_wise = u16::from_le_bytes([record[0], record[1]]) == 1;
        let mut laz = Self {
            items,
            layered,
            chunk_size: if point_wise { u64::MAX } else { u64::from(vlr.chunk_size()) },
            chunks: Vec::new(),
            parts: Vec::new(),
        };
        if let (Some(chunks), true) = (wanted, layered) {
            laz.chunks = chunks;
        } else if !point_wise {
            laz.chunks = match laz.chunk_table(input, layout, &vlr)? {
                Some(chunks) => chunks,
                None if layered => laz.walk_chunks(input, layout)?,
                None if vlr.uses_variable_size_chunks() => {
                    return Err(input.bad("expected a chunk table behind the points, found none; it is cut short"));
                }
                None => Vec::new(),
            };
        }
        laz.parts = group(&laz.chunks);
        Ok(laz)
    }

    /// Parts that can be read side by side.
    pub fn parts(&self) -> usize {
        self.parts.len().max(1)
    }

    /// The chunk table, or `None` if the writer could not go back to note where it is.
    fn chunk_table(&self, input: &Input, layout: &Layout, vlr: &LazVlr) -> Result<Option<Vec<Chunk>>> {
        let (first, mut place, mut head) = (layout.start + 8, [0; 8], [0; 8]);
        input.read_at(layout.start, &mut place)?;
        let mut table_at = u64_at(&place, 0);
        let is_noted = (first as i64..=i64::MAX).contains(&(table_at as i64));
        if !is_noted {
            // A writer to a pipe puts it into the last eight bytes.
            input.read_at(input.len() - 8, &mut place)?;
            table_at = u64_at(&place, 0);
        }
        let is_within = table_at >= first && table_at.checked_add(8).is_some_and(|end| end <= input.len());
        if is_within {
            input.read_at(table_at, &mut head)?;
        }
        if !is_within || u32_at(&head, 0) != 0 {
            if is_noted {
                return Err(input.bad(format!(
                    "expected a chunk table at byte {table_at} of {}, found none; it is cut short or damaged",
                    input.len()
                )));
            }
            return Ok(None);
        }
        let count = u64::from(u32_at(&head, 4));
        // Every chunk begins with one raw point.
        if count > (table_at - first) / layout.record_length as u64 {
            return Err(input.bad(format!("the chunk table promises {count} chunks, more than the file can hold")));
        }
        let variable = vlr.uses_variable_size_chunks();
        let mut stream = BufReader::new(input.stream(table_at));
        let table = guarded(input, || ChunkTable::read(&mut stream, variable).map_err(|e| Error::io(input.path(), e)))?;
        let (mut at, mut left) = (first, layout.points);
        let mut chunks = Vec::with_capacity(table.len());
        for entry in &table {
            let points = if variable { entry.point_count } else { u64::from(vlr.chunk_size()).min(left) };
            let end = at.checked_add(entry.byte_count).filter(|&end| end <= table_at);
            let (Some(end), Some(rest)) = (end, left.checked_sub(points)) else {
                return Err(input.bad("the chunk table does not fit the file; it is damaged"));
            };
            if points > 0 {
                chunks.push(Chunk { start: at, length: entry.byte_count, points });
            }
            (at, left) = (end, rest);
        }
        if left > 0 {
            return Err(input.bad(format!(
                "the header promises {} points, the chunks hold {}; it is cut short",
                layout.points,
                layout.points - left
            )));
        }
        Ok(Some(chunks))
    }

    /// Layered chunks say how long they are: find them without a table.
    fn walk_chunks(&self, input: &Input, layout: &Layout) -> Result<Vec<Chunk>> {
        let (mut at, mut left, mut chunks) = (layout.start + 8, layout.points, Vec::new());
        let mut head = Vec::new();
        while left > 0 {
            input.read_into(at, self.layers_head() as u64, &mut head)?;
            let (points, length) = self.layers(&head);
            let points = points.min(left);
            if points == 0 || length > input.len() - at {
                return Err(input.bad(format!("the chunk at byte {at} is damaged or cut short")));
            }
            chunks.push(Chunk { start: at, length, points });
            at += length;
            left -= points;
        }
        Ok(chunks)
    }

    /// Bytes before the layers of a chunk: a raw point, the number of points, the size of each layer.
    fn layers_head(&self) -> usize {
        let layers: usize = self
            .items
            .iter()
            .map(|item| match item.item_type() {
                LazItemType::Point14 => 9,
                LazItemType::RGBNIR14 => 2,
                LazItemType::Byte14(extra) => usize::from(extra),
                _ => 1,
            })
            .sum();
        self.record_length() + 4 + 4 * layers
    }

    /// Points and bytes of a layered chunk, by its own account.
    fn layers(&self, head: &[u8]) -> (u64, u64) {
        let sizes = &head[self.record_length() + 4..self.layers_head()];
        let layers: u64 = sizes.chunks_exact(4).map(|size| u64::from(u32_at(size, 0))).sum();
        (u64::from(u32_at(head, self.record_length())), self.layers_head() as u64 + layers)
    }

    fn record_length(&self) -> usize {
        self.items.iter().map(|item| usize::from(item.size())).sum()
    }

    /// Decode the chunks of a part.
    pub fn read(&self, input: &Input, layout: &Layout, part: usize, collector: &mut Collector<'_>) -> Result<()> {
        let Some(chunks) = self.parts.get(part) else {
            return self.read_from_start(input, layout, collector);
        };
        let mut bytes = Vec::new();
        for chunk in &self.chunks[chunks.clone()] {
            input.read_into(chunk.start, chunk.length, &mut bytes)?;
            if self.layered {
                let whole = bytes.len() >= self.layers_head() && {
                    let (points, length) = self.layers(&bytes);
                    points >= chunk.points && length <= chunk.length
                };
                if !whole {
                    return Err(input.bad(format!("the chunk at byte {} is damaged", chunk.start)));
                }
                let mut decoder = LayeredPointRecordDecompressor::new(Cursor::new(bytes.as_slice()));
                decoder.set_fields_from(&self.items).map_err(|e| bad_laz(input, e))?;
                let wanted = DecompressionSelection::xy_returns_channel().decompress_z().decompress_point_source_id();
                decoder.set_selection(wanted);
                decode(input, layout, &mut decoder, chunk.points, collector)?;
            } else {
                let mut decoder = SequentialPointRecordDecompressor::new(bytes.as_slice());
                decoder.set_fields_from(&self.items).map_err(|e| bad_laz(input, e))?;
                decode(input, layout, &mut decoder, chunk.points, collector)?;
            }
        }
        Ok(())
    }

    /// Without a table, a chunk's start is known only when the one before it is done.
    fn read_from_start(&self, input: &Input, layout: &Layout, collector: &mut Collector<'_>) -> Result<()> {
        // Even one big chunk begins behind the eight bytes for the table, except in the oldest, point-wise files.
        let start = if self.chunk_size == u64::MAX { layout.start } else { layout.start + 8 };
        let stream = BufReader::with_capacity(1 << 18, input.stream(start));
        let mut decoder = SequentialPointRecordDecompressor::new(stream);
        let mut left = layout.points;
        while left > 0 {
            let points = left.min(self.chunk_size);
            decoder.reset();
            decoder.set_fields_from(&self.items).map_err(|e| bad_laz(input, e))?;
            decode(input, layout, &mut decoder, points, collector)?;
            left -= points;
        }
        Ok(())
    }
}

/// Decode `points` points. The decoder runs apart from the sink, since only the decoder may panic.
fn decode<R>(
    input: &Input,
    layout: &Layout,
    decoder: &mut dyn RecordDecompressor<R>,
    points: u64,
    collector: &mut Collector<'_>,
) -> Result<()> {
    let mut records = vec![0; layout.record_length * READ];
    for first in (0..points).step_by(READ) {
        let count = (points - first).min(READ as u64) as usize;
        let records = &mut records[..count * layout.record_length];
        guarded(input, || {
            let mut each = records.chunks_exact_mut(layout.record_length);
            each.try_for_each(|record| decoder.decompress_next(record).map_err(|e| Error::io(input.path(), e)))
        })?;
        layout.hand_on(records, collector)?;
    }
    Ok(())
}

/// Consecutive chunks that together are worth a part.
fn group(chunks: &[Chunk]) -> Vec<Range<usize>> {
    let (mut parts, mut first, mut points) = (Vec::new(), 0, 0);
    for (i, chunk) in chunks.iter().enumerate() {
        points += chunk.points;
        if points >= PART / 2 || i + 1 == chunks.len() {
            parts.push(first..i + 1);
            (first, points) = (i + 1, 0);
        }
    }
    parts
}

fn bad_laz(input: &Input, error: laz::LasZipError) -> Error {
    input.bad(format!("its LAZ compression cannot be read: {error}"))
}
