//! Uncompressed TIFF files of kinds that no encoder at hand writes.

/// Bilevel and grey of which 0 is white.
pub(crate) const WHITE_IS_ZERO: u16 = 0;
/// Grey of which 0 is black.
pub(crate) const BLACK_IS_ZERO: u16 = 1;
/// Red, green, blue.
pub(crate) const RGB: u16 = 2;
/// Colours by number.
pub(crate) const PALETTE: u16 = 3;

/// Unsigned whole numbers.
pub(crate) const UINT: u16 = 1;
/// Signed whole numbers.
pub(crate) const INT: u16 = 2;
/// IEEE floats.
pub(crate) const FLOAT: u16 = 3;

/// One strip of pixels and the tags that say what they mean; little end first.
#[derive(Debug, Clone)]
pub(crate) struct TiffFile {
    /// Columns.
    pub(crate) width: u32,
    /// Rows.
    pub(crate) height: u32,
    /// Bits of each sample of a pixel.
    pub(crate) bits: Vec<u16>,
    /// Photometric interpretation.
    pub(crate) photometric: u16,
    /// Sample format of every sample.
    pub(crate) format: u16,
    /// What the samples beyond the colours are: 1 premultiplied, 2 plain transparency.
    pub(crate) extra: Option<u16>,
    /// Red, green and blue of each number, 16 bits; all reds first.
    pub(crate) colours: Vec<u16>,
    /// Rows, each from a whole byte.
    pub(crate) data: Vec<u8>,
}

impl TiffFile {
    /// Grey of whole numbers.
    pub(crate) fn grey(width: u32, height: u32, bits: u16, data: Vec<u8>) -> Self {
        Self {
            width,
            height,
            bits: vec![bits],
            photometric: BLACK_IS_ZERO,
            format: UINT,
            extra: None,
            colours: Vec::new(),
            data,
        }
    }

    /// One of each kind, 16 by 16 pixels.
    pub(crate) fn samples() -> Vec<(&'static str, Self)> {
        let grey = |bits: u16| {
            let bytes = 16 * 16 * usize::from(bits) / 8;
            Self::grey(
                16,
                16,
                bits,
                (0..bytes).map(|at| (at * 7 % 256) as u8).collect(),
            )
        };
        let palette = |bits: u16| Self {
            photometric: PALETTE,
            colours: (0..3 * (1_u32 << bits))
                .map(|at| (at * 191 % 65536) as u16)
                .collect(),
            ..grey(bits)
        };
        let floats = |at: i32| (at as f32 / 256.0).to_le_bytes();
        vec![
            ("palette8.tif", palette(8)),
            ("palette4.tif", palette(4)),
            ("palette1.tif", palette(1)),
            ("grey4.tif", grey(4)),
            ("grey2.tif", grey(2)),
            ("bilevel.tif", grey(1)),
            (
                "white_is_zero.tif",
                Self {
                    photometric: WHITE_IS_ZERO,
                    ..grey(1)
                },
            ),
            (
                "grey_alpha8.tif",
                Self {
                    bits: vec![8, 8],
                    extra: Some(2),
                    ..grey(16)
                },
            ),
            (
                "grey_alpha16.tif",
                Self {
                    bits: vec![16, 16],
                    extra: Some(1),
                    ..grey(32)
                },
            ),
            ("grey32.tif", grey(32)),
            (
                "grey_signed16.tif",
                Self {
                    format: INT,
                    ..grey(16)
                },
            ),
            (
                "grey_float32.tif",
                Self {
                    format: FLOAT,
                    data: (0..256).flat_map(floats).collect(),
                    ..grey(32)
                },
            ),
        ]
    }

    /// The file's bytes.
    pub(crate) fn encode(&self) -> Vec<u8> {
        let mut tags = vec![
            (256, Field::Long(self.width)),
            (257, Field::Long(self.height)),
            (258, Field::Shorts(self.bits.clone())),
            (259, Field::Shorts(vec![1])),
            (262, Field::Shorts(vec![self.photometric])),
            (273, Field::Long(8)),
            (277, Field::Shorts(vec![self.bits.len() as u16])),
            (278, Field::Long(self.height)),
            (279, Field::Long(self.data.len() as u32)),
        ];
        if !self.colours.is_empty() {
            tags.push((320, Field::Shorts(self.colours.clone())));
        }
        tags.extend(self.extra.map(|kind| (338, Field::Shorts(vec![kind]))));
        tags.push((339, Field::Shorts(vec![self.format; self.bits.len()])));
        self.with_tags(&tags)
    }

    /// Header, pixels, what does not fit into a tag, tags.
    fn with_tags(&self, tags: &[(u16, Field)]) -> Vec<u8> {
        let mut bytes = b"II*\0\0\0\0\0".to_vec();
        bytes.extend(&self.data);
        bytes.resize(bytes.len().next_multiple_of(2), 0);
        let mut directory = (tags.len() as u16).to_le_bytes().to_vec();
        for (tag, field) in tags {
            let (kind, count, value) = field.parts();
            directory.extend(tag.to_le_bytes());
            directory.extend([kind, 0]);
            directory.extend((count as u32).to_le_bytes());
            let mut cell = value.clone();
            if value.len() > 4 {
                cell = (bytes.len() as u32).to_le_bytes().to_vec();
                bytes.extend(value);
            }
            cell.resize(4, 0);
            directory.extend(cell);
        }
        let place = (bytes.len() as u32).to_le_bytes();
        bytes[4..8].copy_from_slice(&place);
        bytes.extend(directory);
        bytes.extend([0; 4]);
        bytes
    }
}

enum Field {
    Long(u32),
    Shorts(Vec<u16>),
}

impl Field {
    /// Type, count and bytes.
    fn parts(&self) -> (u8, usize, Vec<u8>) {
        match self {
            Self::Long(value) => (4, 1, value.to_le_bytes().to_vec()),
            Self::Shorts(values) => (
                3,
                values.len(),
                values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            ),
        }
    }
}
