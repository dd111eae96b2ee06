//! The records of a ZIP archive whose files are stored without compression, so that its size is known before it is written.
//! Larger archives than 4 GiB, and those of more than 65,534 files, have ZIP64 records.

pub use flate2::Crc;

/// Signature of the record before each file.
pub const FILE: &[u8] = b"PK\x03\x04";
/// Signature of an entry of the directory.
pub const ENTRY: &[u8] = b"PK\x01\x02";
/// Signature of the end of the archive.
pub const END: &[u8] = b"PK\x05\x06";
/// Signatures of the end of a ZIP64 archive, and of the record that says where it is.
const END_64: [&[u8]; 2] = [b"PK\x06\x06", b"PK\x06\x07"];
/// Length of the record before a file without its name, in bytes.
pub const FILE_BYTES: usize = 30;
/// Length of an entry of the directory without its name, in bytes.
pub const ENTRY_BYTES: usize = 46;
/// Length of the end without a comment, in bytes.
pub const END_BYTES: usize = 22;
/// Lengths of the two records of [`END_64`], in bytes.
const END_64_BYTES: [usize; 2] = [56, 20];

/// Stands for a number that a ZIP64 field has.
const IN_FIELD: u32 = u32::MAX;
/// Kind of a ZIP64 field.
const FIELD_64: u16 = 1;
/// Versions of the format that a reader must know, without and with ZIP64.
const NEEDED: [u16; 2] = [20, 45];
/// The archive is made on Unix.
const MADE_ON: u16 = 3 << 8;
/// Names are UTF-8.
const UTF8: u16 = 1 << 11;
/// First day that the format knows, 1 January 1980, so that equal files give equal bytes.
const DAY: u16 = (1 << 5) | 1;
/// A plain file that its owner may write, in Unix attributes.
const ATTRIBUTES: u32 = 0o100_644 << 16;

/// Longest name of a file in an archive, in bytes.
pub const MAX_NAME: usize = u16::MAX as usize;

/// A file of an archive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StoredFile<'n> {
    /// Path with slashes, of at most [`MAX_NAME`] bytes.
    pub name: &'n str,
    /// Length in bytes.
    pub size: u64,
    /// CRC-32 of the content.
    pub crc: u32,
}

/// Where an archive is: what was written so far, or will be.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ArchiveLayout {
    files: u64,
    /// Bytes of the files with their records.
    at: u64,
    /// Bytes of the directory.
    directory: u64,
}

impl StoredFile<'_> {
    const fn is_large(&self) -> bool {
        self.size >= IN_FIELD as u64
    }

    /// Returns the record before the file.
    pub fn record(&self) -> Vec<u8> {
        let is_large = self.is_large();
        let field = if is_large {
            field_64(&[self.size, self.size])
        } else {
            Vec::new()
        };
        let mut bytes = FILE.to_vec();
        add_16(&mut bytes, &[NEEDED[usize::from(is_large)]]);
        self.add_common(&mut bytes, field.len());
        bytes.extend_from_slice(self.name.as_bytes());
        bytes.extend(field);
        bytes
    }

    /// Returns the entry of the directory. `at` is where the record of the file is.
    fn entry(&self, at: u64) -> Vec<u8> {
        let is_far = at >= u64::from(IN_FIELD);
        let mut numbers = Vec::new();
        if self.is_large() {
            numbers.extend([self.size, self.size]);
        }
        if is_far {
            numbers.push(at);
        }
        let field = if numbers.is_empty() {
            Vec::new()
        } else {
            field_64(&numbers)
        };
        let version = NEEDED[usize::from(!numbers.is_empty())];
        let mut bytes = ENTRY.to_vec();
        add_16(&mut bytes, &[MADE_ON | version, version]);
        self.add_common(&mut bytes, field.len());
        // Without a comment, on the first part, of unknown content.
        add_16(&mut bytes, &[0, 0, 0]);
        add_32(&mut bytes, &[ATTRIBUTES, number_32(at)]);
        bytes.extend_from_slice(self.name.as_bytes());
        bytes.extend(field);
        bytes
    }

    /// Adds the fields from the flags to the length of the additional fields, which both records have.
    fn add_common(&self, bytes: &mut Vec<u8>, field: usize) {
        const STORED: u16 = 0;
        const MIDNIGHT: u16 = 0;
        add_16(bytes, &[UTF8, STORED, MIDNIGHT, DAY]);
        let size = number_32(self.size);
        add_32(bytes, &[self.crc, size, size]);
        add_16(bytes, &[self.name.len() as u16, field as u16]);
    }
}

impl ArchiveLayout {
    /// Adds a file and returns its entry of the directory.
    pub fn add(&mut self, file: &StoredFile<'_>) -> Vec<u8> {
        let entry = file.entry(self.at);
        self.files += 1;
        self.at += file.record().len() as u64 + file.size;
        self.directory += entry.len() as u64;
        entry
    }

    /// Returns the number of files.
    pub const fn files(&self) -> u64 {
        self.files
    }

    /// Returns the length of the whole archive in bytes.
    pub fn size(&self) -> u64 {
        self.at + self.directory + self.end().len() as u64
    }

    /// Returns what follows the directory.
    pub fn end(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let most = u64::from(u16::MAX);
        if self.files >= most || self.at.max(self.directory) >= u64::from(IN_FIELD) {
            let [end_bytes, _] = END_64_BYTES;
            let end_at = self.at + self.directory;
            bytes.extend_from_slice(END_64[0]);
            // The length of the rest of the record.
            add_64(&mut bytes, &[end_bytes as u64 - 12]);
            add_16(&mut bytes, &[MADE_ON | NEEDED[1], NEEDED[1]]);
            add_32(&mut bytes, &[0, 0]);
            add_64(
                &mut bytes,
                &[self.files, self.files, self.directory, self.at],
            );
            bytes.extend_from_slice(END_64[1]);
            add_32(&mut bytes, &[0]);
            add_64(&mut bytes, &[end_at]);
            add_32(&mut bytes, &[1]);
        }
        let files = self.files.min(most) as u16;
        bytes.extend_from_slice(END);
        add_16(&mut bytes, &[0, 0, files, files]);
        add_32(&mut bytes, &[number_32(self.directory), number_32(self.at)]);
        add_16(&mut bytes, &[0]);
        bytes
    }
}

/// Returns a number of 32 bits, or what stands for a larger one.
fn number_32(number: u64) -> u32 {
    u32::try_from(number).unwrap_or(IN_FIELD)
}

/// Returns the field of numbers of 64 bits.
fn field_64(numbers: &[u64]) -> Vec<u8> {
    let mut field = Vec::new();
    add_16(&mut field, &[FIELD_64, 8 * numbers.len() as u16]);
    add_64(&mut field, numbers);
    field
}

fn add_16(bytes: &mut Vec<u8>, numbers: &[u16]) {
    bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
}

fn add_32(bytes: &mut Vec<u8>, numbers: &[u32]) {
    bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
}

fn add_64(bytes: &mut Vec<u8>, numbers: &[u64]) {
    bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
}

#[cfg(test)]
mod tests {
    use super::{
        ArchiveLayout, END_64, END_64_BYTES, END_BYTES, ENTRY_BYTES, FILE_BYTES, StoredFile,
    };

    fn file(name: &str, size: u64) -> StoredFile<'_> {
        StoredFile { name, size, crc: 7 }
    }

    #[test]
    fn records_have_the_lengths_of_the_format() {
        let small = file("chữ.png", 10);
        assert_eq!(small.record().len(), FILE_BYTES + small.name.len());
        let mut layout = ArchiveLayout::default();
        let entry = layout.add(&small);
        assert_eq!(entry.len(), ENTRY_BYTES + small.name.len());
        assert_eq!(layout.end().len(), END_BYTES);
        let names = 2 * small.name.len();
        let size = FILE_BYTES + ENTRY_BYTES + END_BYTES + names + 10;
        assert_eq!((layout.files(), layout.size()), (1, size as u64));
    }

    #[test]
    fn large_archives_have_records_of_64_bits() {
        let mut layout = ArchiveLayout::default();
        let large = file("a", 5 << 30);
        assert_eq!(large.record().len(), FILE_BYTES + 1 + 4 + 16);
        assert_eq!(layout.add(&large).len(), ENTRY_BYTES + 1 + 4 + 16);
        // Its content is small, but it is behind 4 GiB.
        assert_eq!(layout.add(&file("b", 1)).len(), ENTRY_BYTES + 1 + 4 + 8);
        let end = layout.end();
        assert_eq!(end.len(), END_64_BYTES.iter().sum::<usize>() + END_BYTES);
        assert!(end.starts_with(END_64[0]) && end[56..].starts_with(END_64[1]));
        let at = u64::from_le_bytes(end[64..72].try_into().expect("8 bytes"));
        assert_eq!(layout.size() - at, end.len() as u64);

        let mut many = ArchiveLayout::default();
        for count in 1..=u64::from(u16::MAX) {
            many.add(&file("a", 0));
            let is_64 = many.end().len() > END_BYTES;
            assert_eq!(is_64, count == u64::from(u16::MAX), "{count}");
        }
    }
}
