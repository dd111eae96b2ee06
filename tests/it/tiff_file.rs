//! Writes kinds of uncompressed TIFF files that the `image` crate cannot encode.

/// Photometric interpretation: 0 is white.
pub(crate) const WHITE_IS_ZERO: u16 = 0;
/// Photometric interpretation: 0 is black.
pub(crate) const BLACK_IS_ZERO: u16 = 1;
/// Photometric interpretation: red, green, blue.
pub(crate) const RGB: u16 = 2;
/// Photometric interpretation: palette indices.
pub(crate) const PALETTE: u16 = 3;

/// Sample format: unsigned integers.
pub(crate) const UINT: u16 = 1;
/// Sample format: signed integers.
pub(crate) const INT: u16 = 2;
/// Sample format: IEEE floats.
pub(crate) const FLOAT: u16 = 3;

/// A little-endian TIFF with one strip of pixels.
#[derive(Debug, Clone)]
pub(crate) struct TiffFile {
    /// Width in pixels.
    pub(crate) width: u32,
    /// Height in pixels.
    pub(crate) height: u32,
    /// Bits per sample.
    pub(crate) bits: Vec<u16>,
    /// Photometric interpretation.
    pub(crate) photometric: u16,
    /// Sample format of all samples.
    pub(crate) format: u16,
    /// Kind of the extra sample: 1 premultiplied alpha, 2 unassociated alpha.
    pub(crate) extra: Option<u16>,
    /// 16-bit palette: all reds, then all greens, then all blues.
    pub(crate) colours: Vec<u16>,
    /// Pixel data; each row starts at a byte boundary.
    pub(crate) data: Vec<u8>,
}

impl TiffFile {
    /// Returns a grey image of unsigned integers.
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

    /// Returns one file of each kind, 16 by 16 pixels.
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

    /// Encodes the file.
    pub(crate) fn encode(&self) -> Vec<u8> {
        let mut tags = vec![
            (256, TagValue::Long(self.width)),
            (257, TagValue::Long(self.height)),
            (258, TagValue::Shorts(self.bits.clone())),
            (259, TagValue::Shorts(vec![1])),
            (262, TagValue::Shorts(vec![self.photometric])),
            (273, TagValue::Long(8)),
            (277, TagValue::Shorts(vec![self.bits.len() as u16])),
            (278, TagValue::Long(self.height)),
            (279, TagValue::Long(self.data.len() as u32)),
        ];
        if !self.colours.is_empty() {
            tags.push((320, TagValue::Shorts(self.colours.clone())));
        }
        tags.extend(self.extra.map(|kind| (338, TagValue::Shorts(vec![kind]))));
        tags.push((339, TagValue::Shorts(vec![self.format; self.bits.len()])));
        self.with_tags(&tags)
    }

    /// Writes the header, the pixels, the values that do not fit in their tags, and the tags.
    fn with_tags(&self, tags: &[(u16, TagValue)]) -> Vec<u8> {
        let mut bytes = b"II*\0\0\0\0\0".to_vec();
        bytes.extend(&self.data);
        bytes.resize(bytes.len().next_multiple_of(2), 0);
        let mut directory = (tags.len() as u16).to_le_bytes().to_vec();
        for (tag, value) in tags {
            let (kind, count, value) = value.parts();
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

enum TagValue {
    Long(u32),
    Shorts(Vec<u16>),
}

impl TagValue {
    /// Returns type, count and bytes.
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
