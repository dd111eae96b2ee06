//! File type detection by signature, for choosing a decoder and for error messages.

/// File type by content, never by name.
///
/// ```
/// use mocban_core::domain::FileKind;
///
/// assert_eq!(FileKind::of(b"\x89PNG\r\n\x1a\n...."), FileKind::Png);
/// assert_eq!(FileKind::of(b"%PDF-1.7").name(), "PDF document");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// Portable Network Graphics.
    Png,
    /// JPEG in any container.
    Jpeg,
    /// TIFF or `BigTIFF`, either byte order.
    Tiff,
    /// An unsupported image format.
    OtherImage(&'static str),
    /// A mesh in the Stanford polygon format.
    Ply,
    /// An unsupported 3D format.
    OtherMesh(&'static str),
    /// Another format with a known signature.
    Other(&'static str),
    /// The text that Git LFS stores in place of a large file that was not fetched.
    LfsPointer,
    /// Printable text without a signature.
    Text,
    /// Bytes without a known signature.
    Binary,
}

const SIGNATURES: [(&[u8], FileKind); 31] = [
    (b"\x89PNG\r\n\x1a\n", FileKind::Png),
    (b"\xff\xd8\xff", FileKind::Jpeg),
    (b"II*\0", FileKind::Tiff),
    (b"MM\0*", FileKind::Tiff),
    (b"II+\0", FileKind::Tiff),
    (b"MM\0+", FileKind::Tiff),
    (b"GIF8", FileKind::OtherImage("a GIF image")),
    (b"BM", FileKind::OtherImage("a BMP image")),
    (b"8BPS", FileKind::OtherImage("a Photoshop image")),
    (b"\0\0\0\x0cjP  ", FileKind::OtherImage("a JPEG 2000 image")),
    (
        b"\xff\x4f\xff\x51",
        FileKind::OtherImage("a JPEG 2000 image"),
    ),
    (b"\0\0\0\x0cJXL ", FileKind::OtherImage("a JPEG XL image")),
    (b"ply\n", FileKind::Ply),
    (b"ply\r", FileKind::Ply),
    (b"glTF", FileKind::OtherMesh("a binary glTF scene")),
    (b"OFF\n", FileKind::OtherMesh("an OFF mesh")),
    (b"OFF\r", FileKind::OtherMesh("an OFF mesh")),
    (b"Kaydara FBX", FileKind::OtherMesh("an FBX scene")),
    (b"#VRML", FileKind::OtherMesh("a VRML scene")),
    (b"# .PCD", FileKind::OtherMesh("a PCD point cloud")),
    (b"LASF", FileKind::OtherMesh("a LAS point cloud")),
    (b"%PDF", FileKind::Other("a PDF document")),
    (b"version https://git-lfs", FileKind::LfsPointer),
    (b"PK\x03\x04", FileKind::Other("a ZIP archive")),
    (b"\x1f\x8b", FileKind::Other("a gzip archive")),
    (b"7z\xbc\xaf", FileKind::Other("a 7-Zip archive")),
    (b"Rar!", FileKind::Other("a RAR archive")),
    (b"SQLite format 3", FileKind::Other("an SQLite database")),
    (b"\xff\xfe", FileKind::Other("UTF-16 text")),
    (b"\xfe\xff", FileKind::Other("UTF-16 text")),
    (b"<", FileKind::Other("XML or HTML text")),
];

/// Extensions of unsupported images and documents.
const UNREAD_IMAGES: [(&[&str], FileKind); 9] = [
    (&["bmp", "dib"], FileKind::OtherImage("a BMP image")),
    (&["webp"], FileKind::OtherImage("a WebP image")),
    (&["gif"], FileKind::OtherImage("a GIF image")),
    (
        &["jp2", "j2k", "jpf", "jpx"],
        FileKind::OtherImage("a JPEG 2000 image"),
    ),
    (&["jxl"], FileKind::OtherImage("a JPEG XL image")),
    (&["heic", "heif"], FileKind::OtherImage("a HEIC image")),
    (&["avif"], FileKind::OtherImage("an AVIF image")),
    (&["psd"], FileKind::OtherImage("a Photoshop image")),
    (&["pdf"], FileKind::Other("a PDF document")),
];

impl FileKind {
    /// Returns the type of a file that begins with these bytes.
    pub fn of(bytes: &[u8]) -> Self {
        if bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") {
            return Self::OtherImage("a WebP image");
        }
        let brand = bytes.get(8..12).filter(|_| &bytes[4..8] == b"ftyp");
        match brand {
            Some(b"avif" | b"avis") => return Self::OtherImage("an AVIF image"),
            Some(b"heic" | b"heim" | b"heis" | b"heix" | b"hevc" | b"mif1" | b"msf1") => {
                return Self::OtherImage("a HEIC image");
            }
            _ => {}
        }
        SIGNATURES
            .iter()
            .find(|(signature, _)| bytes.starts_with(signature))
            .map_or_else(|| Self::without_signature(bytes), |(_, kind)| *kind)
    }

    fn without_signature(bytes: &[u8]) -> Self {
        let head = &bytes[..bytes.len().min(512)];
        let control = |byte: &u8| *byte < 0x20 && !b"\t\n\r\x0c".contains(byte);
        if head.iter().any(control) {
            Self::Binary
        } else {
            Self::Text
        }
    }

    /// Returns a description that completes "the file is".
    pub const fn description(self) -> &'static str {
        match self {
            Self::Png => "a PNG image",
            Self::Jpeg => "a JPEG image",
            Self::Tiff => "a TIFF image",
            Self::Ply => "a PLY mesh",
            Self::OtherImage(name) | Self::OtherMesh(name) | Self::Other(name) => name,
            Self::LfsPointer => "a pointer of Git LFS",
            Self::Text => "text",
            Self::Binary => "binary data of unknown kind",
        }
    }

    /// Returns the type of image that files with an extension usually are, if it is not read.
    pub fn of_unread_extension(extension: &str) -> Option<Self> {
        let extension = extension.to_ascii_lowercase();
        let mut images = UNREAD_IMAGES.into_iter();
        let found = images.find(|(extensions, _)| extensions.contains(&extension.as_str()));
        found.map(|(_, kind)| kind)
    }

    /// Returns what to do with files of this type where images are needed, if that does not depend on the file.
    pub fn image_advice(self) -> Option<String> {
        let mut images = UNREAD_IMAGES.into_iter();
        let (extensions, _) = images.find(|(_, kind)| *kind == self)?;
        let extension = extensions[0];
        Some(if extension == "pdf" {
            "save their pages as images, such as with `pdftoppm -r 600 -png FILE.pdf page`"
                .to_owned()
        } else {
            format!(
                "convert them, such as with ImageMagick: `magick mogrify -format png *.{extension}`"
            )
        })
    }

    /// Returns the description without the article.
    pub fn name(self) -> &'static str {
        let text = self.description();
        let name = text.strip_prefix("a ").or(text.strip_prefix("an "));
        name.unwrap_or(text)
    }
}

impl std::fmt::Display for FileKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.description())
    }
}

#[cfg(test)]
mod tests {
    use super::{FileKind, UNREAD_IMAGES};

    #[test]
    fn unread_images_are_known_by_extension_and_have_advice() {
        for (extensions, kind) in UNREAD_IMAGES {
            for extension in extensions {
                assert_eq!(FileKind::of_unread_extension(extension), Some(kind));
            }
            let advice = kind.image_advice().expect("advice");
            assert!(advice.contains(extensions[0]), "{advice}");
        }
        assert_eq!(
            FileKind::of_unread_extension("PDF"),
            Some(FileKind::Other("a PDF document"))
        );
        assert_eq!(FileKind::of_unread_extension("png"), None);
        assert_eq!(FileKind::Text.image_advice(), None);
    }

    #[test]
    fn types_are_detected_by_content() {
        assert_eq!(FileKind::of(b"\x89PNG\r\n\x1a\n...."), FileKind::Png);
        assert_eq!(FileKind::of(b"\xff\xd8\xff\xe0"), FileKind::Jpeg);
        assert_eq!(FileKind::of(b"MM\0*rest"), FileKind::Tiff);
        assert_eq!(
            FileKind::of(b"RIFF\0\0\0\0WEBPVP8 "),
            FileKind::OtherImage("a WebP image")
        );
        assert_eq!(
            FileKind::of(b"\0\0\0\x1cftypheic"),
            FileKind::OtherImage("a HEIC image")
        );
        let pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 9\n";
        assert_eq!(FileKind::of(pointer), FileKind::LfsPointer);
        assert_eq!(FileKind::of(b"hello there"), FileKind::Text);
        assert_eq!(FileKind::of(&[0, 1, 2]), FileKind::Binary);
    }
}
