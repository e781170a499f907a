//! COPC: LAZ whose chunks are the nodes of an octree. Each level halves the spacing of the one above and leaves out
//! the points that those above have already, so a cloud is seen whole, only coarser, in its upper levels.

use super::input::{Input, f64_at, i32_at, u32_at, u64_at};
use super::las::Layout;
use super::laz::Chunk;
use crate::Result;

/// Bytes of an entry of the hierarchy: level, x, y, z, place, bytes, points.
const ENTRY: u64 = 32;

/// The nodes of the levels down to the first whose points are at most `spacing` apart, in the order of the file.
pub(super) fn nodes(input: &Input, layout: &Layout, info: &[u8], spacing: f64) -> Result<Vec<Chunk>> {
    if info.len() < 56 {
        return Err(input.bad(format!("expected a COPC record of 160 bytes, found {} bytes", info.len())));
    }
    let (at_root, root) = (f64_at(info, 32), (u64_at(info, 40), u64_at(info, 48)));
    if !(at_root.is_finite() && at_root > 0.0) {
        return Err(input.bad(format!("expected a spacing above 0 in its COPC record, found {at_root}")));
    }
    // A hair less, so that rounding does not ask for one more level.
    let deepest = (at_root / spacing).log2() - 1e-9;
    let deepest = deepest.ceil().max(0.0) as i32;
    let (mut pages, mut chunks, mut bytes) = (vec![root], Vec::new(), Vec::new());
    let (mut left, mut unread) = (layout.points, input.len());
    while let Some((at, length)) = pages.pop() {
        // Pages do not overlap: together they are no longer than the file, or they lead round in a circle.
        let Some(rest) = unread.checked_sub(length).filter(|_| length % ENTRY == 0) else {
            return Err(input.bad("its COPC hierarchy does not fit the file; it is damaged"));
        };
        unread = rest;
        input.read_into(at, length, &mut bytes)?;
        for entry in bytes.chunks_exact(ENTRY as usize) {
            let (level, place, length) = (i32_at(entry, 0), u64_at(entry, 16), u64::from(u32_at(entry, 24)));
            match i32_at(entry, 28) {
                _ if level > deepest => {}
                -1 => pages.push((place, length)),
                0 => {}
                points => {
                    let points = u64::try_from(points).unwrap_or(u64::MAX);
                    let rest = left.checked_sub(points);
                    let end = place.checked_add(length).filter(|&end| end <= input.len());
                    let (Some(rest), Some(_)) = (rest, end) else {
                        return Err(input.bad("a node of its COPC hierarchy does not fit the file; it is damaged"));
                    };
                    left = rest;
                    chunks.push(Chunk { start: place, length, points });
                }
            }
        }
    }
    chunks.sort_unstable_by_key(|chunk| chunk.start);
    Ok(chunks)
}
