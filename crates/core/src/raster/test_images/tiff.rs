//! Writes TIFF files of any tags, for tests.

/// The values of a tag, in the type that the file stores.
#[derive(Debug, Clone)]
pub enum TestValues {
    /// BYTE.
    Bytes(Vec<u8>),
    /// SHORT.
    Shorts(Vec<u16>),
    /// LONG.
    Longs(Vec<u32>),
    /// SLONG.
    SignedLongs(Vec<i32>),
    /// RATIONAL: numbers above and below the line.
    Ratios(Vec<[u32; 2]>),
    /// LONG8.
    Longs8(Vec<u64>),
}

impl TestValues {
    /// Returns the type, the length of a value, and the values, with the most significant bytes first.
    fn parts(&self) -> (u16, usize, Vec<u8>) {
        match self {
            Self::Bytes(values) => (1, 1, values.clone()),
            Self::Shorts(values) => (3, 2, values.iter().flat_map(|v| v.to_be_bytes()).collect()),
            Self::Longs(values) => (4, 4, values.iter().flat_map(|v| v.to_be_bytes()).collect()),
            Self::SignedLongs(values) => {
                (9, 4, values.iter().flat_map(|v| v.to_be_bytes()).collect())
            }
            Self::Ratios(values) => {
                let numbers = values.as_flattened().iter();
                (5, 4, numbers.flat_map(|v| v.to_be_bytes()).collect())
            }
            Self::Longs8(values) => (16, 8, values.iter().flat_map(|v| v.to_be_bytes()).collect()),
        }
    }
}

/// A page with its strips or tiles, and the pages of which it is a preview.
#[derive(Debug, Clone, Default)]
pub struct TestPage {
    /// Tags in any order, without offsets.
    pub tags: Vec<(u16, TestValues)>,
    /// The stored strips or tiles.
    pub chunks: Vec<Vec<u8>>,
    /// The pages in its subdirectories.
    pub pictures: Vec<TestPage>,
}

impl TestPage {
    /// Returns a page of a size, with its photometric interpretation, bits and samples per pixel.
    pub fn new(size: [u32; 2], photometric: u16, bits: u16, samples: u16) -> Self {
        Self::default()
            .with(256, TestValues::Longs(vec![size[0]]))
            .with(257, TestValues::Longs(vec![size[1]]))
            .with(258, TestValues::Shorts(vec![bits; usize::from(samples)]))
            .short(262, photometric)
            .short(277, samples)
    }

    /// Sets a tag.
    #[must_use]
    pub fn with(mut self, tag: u16, values: TestValues) -> Self {
        self.tags.retain(|(other, _)| *other != tag);
        self.tags.push((tag, values));
        self
    }

    /// Sets a tag of one number.
    #[must_use]
    pub fn short(self, tag: u16, value: u16) -> Self {
        self.with(tag, TestValues::Shorts(vec![value]))
    }

    /// Sets strips of some rows.
    #[must_use]
    pub fn strips(self, rows: u32, strips: Vec<Vec<u8>>) -> Self {
        Self {
            chunks: strips,
            ..self.with(278, TestValues::Longs(vec![rows]))
        }
    }

    /// Sets tiles of a size.
    #[must_use]
    pub fn tiles(self, [width, height]: [u16; 2], tiles: Vec<Vec<u8>>) -> Self {
        Self {
            chunks: tiles,
            ..self.short(322, width).short(323, height)
        }
    }
}

/// A file whose byte order and kind can be chosen.
#[derive(Debug, Clone, Copy, Default)]
pub struct TestTiff {
    /// Whether the most significant byte of a number is first.
    pub is_big_endian: bool,
    /// Whether offsets have eight bytes.
    pub is_big_tiff: bool,
}

impl TestTiff {
    /// Both byte orders.
    pub const BYTE_ORDERS: [Self; 2] = [Self::of(false, false), Self::of(true, false)];
    /// Both byte orders, with offsets of four bytes and of eight.
    pub const ALL: [Self; 4] = [
        Self::of(false, false),
        Self::of(true, false),
        Self::of(false, true),
        Self::of(true, true),
    ];

    const fn of(is_big_endian: bool, is_big_tiff: bool) -> Self {
        Self {
            is_big_endian,
            is_big_tiff,
        }
    }

    fn number(self, value: u64, len: usize) -> Vec<u8> {
        let bytes = value.to_le_bytes()[..len].to_vec();
        self.ordered(&bytes, len)
    }

    /// Reverses each number of `len` bytes if the file is big-endian. `bytes` are little-endian.
    fn ordered(self, bytes: &[u8], len: usize) -> Vec<u8> {
        let numbers = bytes.chunks(len);
        let order = |number: &[u8]| {
            let mut number = number.to_vec();
            if self.is_big_endian {
                number.reverse();
            }
            number
        };
        numbers.flat_map(order).collect()
    }

    /// Writes the pages one after the other.
    pub fn encode(self, pages: &[TestPage]) -> Vec<u8> {
        let len = if self.is_big_tiff { 8 } else { 4 };
        let mut file = if self.is_big_endian { b"MM" } else { b"II" }.to_vec();
        if self.is_big_tiff {
            file.extend([self.number(43, 2), self.number(8, 2), self.number(0, 2)].concat());
        } else {
            file.extend(self.number(42, 2));
        }
        let mut link = file.len();
        file.extend(self.number(0, len));
        for page in pages {
            let at = self.add_page(&mut file, page);
            let offset = self.number(at as u64, len);
            file[link..link + len].copy_from_slice(&offset);
            link = file.len() - len;
        }
        file
    }

    /// Adds a page at the end, with a link to no other page. Returns where it begins.
    fn add_page(self, file: &mut Vec<u8>, page: &TestPage) -> usize {
        let len = if self.is_big_tiff { 8 } else { 4 };
        let mut page = page.clone();
        let pictures: Vec<_> = page
            .pictures
            .iter()
            .map(|p| self.add_page(file, p) as u32)
            .collect();
        if !pictures.is_empty() {
            page = page.with(330, TestValues::Longs(pictures));
        }
        let mut places = Vec::new();
        for chunk in &page.chunks {
            places.push(file.len() as u32);
            file.extend(chunk);
        }
        let counts: Vec<_> = page.chunks.iter().map(|chunk| chunk.len() as u32).collect();
        let is_tiled = page.tags.iter().any(|(tag, _)| *tag == 322);
        let [offset_tag, count_tag] = if is_tiled { [324, 325] } else { [273, 279] };
        if !places.is_empty() {
            page = page.with(offset_tag, TestValues::Longs(places));
            page = page.with(count_tag, TestValues::Longs(counts));
        }
        page.tags.sort_by_key(|(tag, _)| *tag);
        let count_len = if self.is_big_tiff { 8 } else { 2 };
        let mut directory = self.number(page.tags.len() as u64, count_len);
        for (tag, values) in &page.tags {
            let (kind, value_len, bytes) = values.parts();
            let count = bytes.len() / value_len / if kind == 5 { 2 } else { 1 };
            let mut bytes: Vec<u8> = bytes
                .chunks(value_len)
                .flat_map(|v| v.iter().rev())
                .copied()
                .collect();
            bytes = self.ordered(&bytes, value_len);
            if bytes.len() > len {
                let place = self.number(file.len() as u64, len);
                file.extend(std::mem::replace(&mut bytes, place));
            }
            bytes.resize(len, 0);
            directory.extend(self.number(u64::from(*tag), 2));
            directory.extend(self.number(u64::from(kind), 2));
            directory.extend(self.number(count as u64, len));
            directory.extend(bytes);
        }
        let at = file.len();
        file.extend(directory);
        file.extend(self.number(0, len));
        at
    }
}
