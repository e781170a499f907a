//! Pages of the file, each with a checksum at its end.

use super::super::input::Input;
use crate::Result;

/// Bytes of checksum at the end of each page.
const CHECKSUM: u64 = 4;

/// The file without its checksums, each of which is verified.
pub(super) struct Pages<'a> {
    pub input: &'a Input,
    pub page_size: u64,
    /// Physical bytes to read together.
    ahead: u64,
    physical: Vec<u8>,
    /// What is at hand, from logical byte `first` on.
    window: Vec<u8>,
    first: u64,
}

impl<'a> Pages<'a> {
    pub fn new(input: &'a Input, page_size: u64, ahead: u64) -> Self {
        Self { input, page_size, ahead, physical: Vec::new(), window: Vec::new(), first: 0 }
    }

    /// The logical place of a physical one.
    pub fn logical(&self, physical: u64) -> Result<u64> {
        let (page, within) = (physical / self.page_size, physical % self.page_size);
        if physical >= self.input.len() || within >= self.page_size - CHECKSUM {
            return Err(self.input.bad(format!("expected points at byte {physical}, which is not in the file")));
        }
        Ok(page * (self.page_size - CHECKSUM) + within)
    }

    /// `length` logical bytes from `at` on.
    pub fn get(&mut self, at: u64, length: usize) -> Result<&[u8]> {
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
