//! A file whose bytes are asked for by place, so that threads read side by side, and which never
//! hands out more than it holds: whatever a header claims, buffers are bounded by the file's size.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use crate::{Error, Result};

/// An opened regular file and its size when it was opened.
#[derive(Debug)]
pub(crate) struct Input {
    path: PathBuf,
    file: File,
    len: u64,
}

impl Input {
    /// Open a regular file that is not empty.
    pub fn open(path: &Path) -> Result<Self> {
        let metadata = std::fs::metadata(path).map_err(|e| Error::io(path, e))?;
        if metadata.is_dir() {
            return Err(Error::bad_file(path, "expected a file, found a directory"));
        }
        if !metadata.is_file() {
            return Err(Error::bad_file(path, "expected a regular file, found a pipe or a device"));
        }
        if metadata.len() == 0 {
            return Err(Error::bad_file(path, "expected points, found an empty file (0 bytes)"));
        }
        let file = File::open(path).map_err(|e| Error::io(path, e))?;
        Ok(Self { path: path.to_owned(), file, len: metadata.len() })
    }

    /// Where it was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its size in bytes when it was opened.
    pub fn len(&self) -> u64 {
        self.len
    }

    /// The error that blames this file.
    pub fn bad(&self, message: impl Into<String>) -> Error {
        Error::bad_file(&self.path, message)
    }

    /// Fill `buffer` from `offset` on. A file that ends before, or has shrunk, is an error.
    pub fn read_at(&self, offset: u64, buffer: &mut [u8]) -> Result<()> {
        read_exact_at(&self.file, buffer, offset).map_err(|e| Error::io(&self.path, e))
    }

    /// Make `buffer` hold the `len` bytes from `offset` on, allocating no more than the file has.
    pub fn read_into(&self, offset: u64, len: u64, buffer: &mut Vec<u8>) -> Result<()> {
        let end = offset.checked_add(len).filter(|&end| end <= self.len);
        let (Some(_), Ok(len)) = (end, usize::try_from(len)) else {
            return Err(self.bad(format!(
                "expected {len} bytes at {offset}, found a file of {} bytes; it is cut short",
                self.len
            )));
        };
        // Growing only: what is overwritten at once need not be zeroed first.
        buffer.resize(len, 0);
        self.read_at(offset, buffer)
    }

    /// The first bytes, at most `len`.
    pub fn head(&self, len: usize) -> Result<Vec<u8>> {
        let mut head = Vec::new();
        self.read_into(0, self.len.min(len as u64), &mut head)?;
        Ok(head)
    }

    /// A reader of its own that starts at `offset`.
    pub fn stream(&self, offset: u64) -> Stream<'_> {
        Stream { input: self, position: offset }
    }

    /// A key made from what the file holds from `offset` on (its size, its first and last bytes): the same
    /// wherever the file lies, whatever it is called.
    pub fn content_key(&self, offset: u64) -> Result<String> {
        const SAMPLE: u64 = 64 * 1024;
        let (mut bytes, mut hash) = (Vec::new(), Fnv::new());
        self.read_into(offset, SAMPLE.min(self.len - offset.min(self.len)), &mut bytes)?;
        hash.update(&bytes);
        self.read_into(self.len.saturating_sub(SAMPLE), SAMPLE.min(self.len), &mut bytes)?;
        hash.update(&bytes);
        hash.update(&self.len.to_le_bytes());
        Ok(format!("{:016x}", hash.0))
    }
}

/// The 64-bit FNV-1a hash: short, and the same on every machine and in every version.
pub(crate) struct Fnv(pub u64);

impl Fnv {
    pub fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    pub fn update(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

/// A position in an [`Input`], as readers of other crates want it.
#[derive(Debug)]
pub(crate) struct Stream<'a> {
    input: &'a Input,
    position: u64,
}

impl Read for Stream<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let left = self.input.len.saturating_sub(self.position);
        let len = buffer.len().min(usize::try_from(left).unwrap_or(usize::MAX));
        read_exact_at(&self.input.file, &mut buffer[..len], self.position)?;
        self.position += len as u64;
        Ok(len)
    }
}

impl Seek for Stream<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let position = match to {
            SeekFrom::Start(offset) => Some(offset),
            SeekFrom::Current(delta) => self.position.checked_add_signed(delta),
            SeekFrom::End(delta) => self.input.len.checked_add_signed(delta),
        };
        self.position = position.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(self.position)
    }
}

#[cfg(unix)]
fn read_exact_at(file: &File, buffer: &mut [u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, buffer, offset)
}

#[cfg(windows)]
fn read_exact_at(file: &File, mut buffer: &mut [u8], mut offset: u64) -> io::Result<()> {
    while !buffer.is_empty() {
        match std::os::windows::fs::FileExt::seek_read(file, buffer, offset) {
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(read) => {
                buffer = &mut buffer[read..];
                offset += read as u64;
            }
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(())
}

/// The `N` bytes at `at`; the caller has checked that they are there.
#[inline]
pub(crate) fn array<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    let mut array = [0; N];
    array.copy_from_slice(&bytes[at..at + N]);
    array
}

/// The little-endian u16 at `at`.
#[inline]
pub(crate) fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes(array(bytes, at))
}

/// The little-endian u32 at `at`.
#[inline]
pub(crate) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(array(bytes, at))
}

/// The little-endian u64 at `at`.
#[inline]
pub(crate) fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(array(bytes, at))
}

/// The little-endian i32 at `at`.
#[inline]
pub(crate) fn i32_at(bytes: &[u8], at: usize) -> i32 {
    i32::from_le_bytes(array(bytes, at))
}

/// The little-endian f64 at `at`.
#[inline]
pub(crate) fn f64_at(bytes: &[u8], at: usize) -> f64 {
    f64::from_le_bytes(array(bytes, at))
}
