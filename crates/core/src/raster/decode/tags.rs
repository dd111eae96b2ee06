//! Reads the directories of tags that TIFF files and EXIF blocks consist of.

use std::cell::RefCell;
use std::io::{Read, Seek, SeekFrom};

/// Most tags of a directory. A classic TIFF cannot have more.
const MAX_TAGS: usize = u16::MAX as usize;

/// Where the bytes of tags are: in memory, or in a file.
pub(super) trait TagSource {
    /// Reads bytes at an offset, or returns `None` if they are not all there.
    fn read(&self, at: usize, bytes: &mut [u8]) -> Option<()>;

    /// Returns bytes in memory.
    fn slice(&self, at: usize, len: usize) -> Option<&[u8]>;
}

impl TagSource for &[u8] {
    fn read(&self, at: usize, bytes: &mut [u8]) -> Option<()> {
        bytes.copy_from_slice(self.slice(at, bytes.len())?);
        Some(())
    }

    fn slice(&self, at: usize, len: usize) -> Option<&[u8]> {
        self.get(at..at.checked_add(len)?)
    }
}

/// Bytes of a file that are read at once, because the tags of a directory are near each other.
const WINDOW_BYTES: u64 = 4096;

/// A file and the part of it that was read last.
pub(super) struct TagFileWindow<F> {
    file: RefCell<F>,
    /// Where the part begins, and its bytes.
    window: RefCell<(usize, Vec<u8>)>,
}

impl<F> TagFileWindow<F> {
    pub(super) fn new(file: F) -> Self {
        Self {
            file: RefCell::new(file),
            window: RefCell::default(),
        }
    }
}

impl<F: Read + Seek> TagSource for TagFileWindow<F> {
    fn read(&self, at: usize, bytes: &mut [u8]) -> Option<()> {
        let (start, window) = &mut *self.window.borrow_mut();
        let is_inside =
            |start: usize, window: &[u8]| at >= start && at - start + bytes.len() <= window.len();
        if !is_inside(*start, window) {
            let mut file = self.file.borrow_mut();
            window.clear();
            *start = at;
            file.seek(SeekFrom::Start(at as u64)).ok()?;
            file.by_ref().take(WINDOW_BYTES).read_to_end(window).ok()?;
        }
        bytes.copy_from_slice(window.get(at - *start..)?.get(..bytes.len())?);
        Some(())
    }

    fn slice(&self, _: usize, _: usize) -> Option<&[u8]> {
        None
    }
}

/// A TIFF file or an EXIF block. Offsets have eight bytes in a `BigTIFF`, and four bytes otherwise.
#[derive(Clone, Copy)]
pub(super) struct TaggedFile<'b> {
    source: &'b dyn TagSource,
    pub(super) is_big_endian: bool,
    is_big_tiff: bool,
}

impl<'b> TaggedFile<'b> {
    /// Reads the header. Returns `None` if there is none.
    pub(super) fn new(source: &'b dyn TagSource) -> Option<Self> {
        let mut order = [0; 2];
        source.read(0, &mut order)?;
        let is_big_endian = match &order {
            b"MM" => true,
            b"II" => false,
            _ => return None,
        };
        let mut file = Self {
            source,
            is_big_endian,
            is_big_tiff: false,
        };
        file.is_big_tiff = file.number(2, 2)? == 43;
        Some(file)
    }

    /// Returns a number of at most eight bytes, or `None` if the file ends before its last byte.
    fn number(&self, at: usize, len: usize) -> Option<u64> {
        let mut field = [0; 8];
        let field = &mut field[..len];
        self.source.read(at, field)?;
        let add = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
        Some(if self.is_big_endian {
            field.iter().fold(0, add)
        } else {
            field.iter().rev().fold(0, add)
        })
    }

    /// Returns the length of an offset in bytes, which is also where the offset of the first directory is.
    const fn offset_len(&self) -> usize {
        if self.is_big_tiff { 8 } else { 4 }
    }

    /// Returns the first directory, or `None` if its offset is after the end of the file.
    pub(super) fn first_directory(&self) -> Option<TagDirectory<'b>> {
        let len = self.offset_len();
        self.directory_at(self.number(len, len)?)
    }

    /// Returns the directory at an offset, or `None` if the file ends before its first tag.
    pub(super) fn directory_at(&self, offset: u64) -> Option<TagDirectory<'b>> {
        let at = usize::try_from(offset).ok()?;
        let count_len = if self.is_big_tiff { 8 } else { 2 };
        let tags = usize::try_from(self.number(at, count_len)?).ok()?;
        let directory = TagDirectory {
            file: *self,
            first_tag: at + count_len,
            tags,
        };
        Some(directory).filter(|_| tags <= MAX_TAGS)
    }
}

/// A directory of tags. In a TIFF file, it describes a page.
#[derive(Clone, Copy)]
pub(super) struct TagDirectory<'b> {
    pub(super) file: TaggedFile<'b>,
    first_tag: usize,
    tags: usize,
}

impl<'b> TagDirectory<'b> {
    const fn tag_len(&self) -> usize {
        2 * self.file.offset_len() + 4
    }

    /// Returns where a tag is.
    fn position(&self, tag: u64) -> Option<usize> {
        let places = (0..self.tags).map(|nth| self.first_tag + nth * self.tag_len());
        let mut found = places.map_while(|at| Some((at, self.file.number(at, 2)?)));
        found.find(|(_, other)| *other == tag).map(|(at, _)| at)
    }

    /// Returns whether the directory has a tag, even if its values are of an unknown type or not in the file.
    pub(super) fn has(&self, tag: u64) -> bool {
        self.position(tag).is_some()
    }

    /// Returns the values of a tag, if the directory has it, it has at least one, and they can be read.
    pub(super) fn values(&self, tag: u64) -> Option<TagValues<'b>> {
        let (file, len) = (self.file, self.file.offset_len());
        let at = self.position(tag)?;
        let kind = file.number(at + 2, 2)?;
        let (value_len, is_signed) = match kind {
            1 | 7 => (1, false),
            6 => (1, true),
            3 => (2, false),
            8 => (2, true),
            4 | 13 => (4, false),
            9 => (4, true),
            5 | 16 | 18 => (8, false),
            10 | 17 => (8, true),
            _ => return None,
        };
        let count = usize::try_from(file.number(at + 4, len)?).ok()?;
        let field = at + 4 + len;
        let start = if count.checked_mul(value_len)? <= len {
            field
        } else {
            usize::try_from(file.number(field, len)?).ok()?
        };
        let end = start.checked_add(count * value_len)?;
        let last = end.checked_sub(1).filter(|_| count > 0)?;
        file.number(last, 1)?;
        Some(TagValues {
            file,
            start,
            count,
            value_len,
            is_signed,
            is_ratio: matches!(kind, 5 | 10),
        })
    }

    /// Returns the first value of a tag as a whole number, whatever integer type the file stores it as.
    pub(super) fn number(&self, tag: u64) -> Option<u64> {
        self.values(tag)?.get(0)
    }

    /// Returns the offset of the next directory, or `None` if the file ends before it. 0 stands for no directory.
    pub(super) fn next_offset(&self) -> Option<u64> {
        let at = self.first_tag + self.tags * self.tag_len();
        self.file.number(at, self.file.offset_len())
    }
}

/// The values of a tag, all of which are in the file. They are read on demand, so that a count needs no memory.
#[derive(Clone, Copy)]
pub(super) struct TagValues<'b> {
    file: TaggedFile<'b>,
    start: usize,
    count: usize,
    value_len: usize,
    is_signed: bool,
    is_ratio: bool,
}

impl<'b> TagValues<'b> {
    /// Returns how many values the tag has.
    pub(super) const fn len(&self) -> usize {
        self.count
    }

    /// Returns a value as a whole number, or `None` if there is none at this position, or if it is negative or a ratio.
    pub(super) fn get(&self, at: usize) -> Option<u64> {
        if at >= self.count || self.is_ratio {
            return None;
        }
        let value = self
            .file
            .number(self.start + at * self.value_len, self.value_len)?;
        let sign = 1 << (8 * self.value_len - 1);
        (!self.is_signed || value & sign == 0).then_some(value)
    }

    /// Returns all values as whole numbers.
    pub(super) fn iter(&self) -> impl Iterator<Item = Option<u64>> {
        (0..self.count).map(|at| self.get(at))
    }

    /// Returns a value that is a ratio of two whole numbers.
    pub(super) fn ratio(&self, at: usize) -> Option<f64> {
        if at >= self.count || !self.is_ratio || self.is_signed {
            return self.get(at).map(|value| value as f64);
        }
        let start = self.start + at * self.value_len;
        let [above, below] = [0, 4].map(|part| self.file.number(start + part, 4));
        Some(above? as f64 / below? as f64).filter(|ratio| ratio.is_finite())
    }

    /// Returns the first bytes of all values, at most `most`.
    pub(super) fn first_bytes(&self, most: usize) -> Option<Vec<u8>> {
        let window = WINDOW_BYTES as usize;
        let mut bytes = vec![0; (self.count * self.value_len).min(most)];
        for (nth, part) in bytes.chunks_mut(window).enumerate() {
            self.file.source.read(self.start + nth * window, part)?;
        }
        Some(bytes)
    }

    /// Returns the bytes of all values, if the file is in memory.
    pub(super) fn bytes(&self) -> Option<&'b [u8]> {
        let source = self.file.source;
        source.slice(self.start, self.count * self.value_len)
    }
}
