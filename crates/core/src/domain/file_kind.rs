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

const SIGNATURES: &[(&[u8], FileKind)] = &[
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
    (b"\xff\x0a", FileKind::OtherImage("a JPEG XL image")),
    (b"ply\n", FileKind::Ply),
    (b"ply\r", FileKind::Ply),
    (b"glTF", GLTF),
    (b"Kaydara FBX", FileKind::OtherMesh("an FBX scene")),
    (b"; FBX", FileKind::OtherMesh("an FBX scene")),
    (b"BLENDER", FileKind::OtherMesh("a Blender scene")),
    (b"PXR-USDC", FileKind::OtherMesh("a USD scene")),
    (b"#usda", FileKind::OtherMesh("a USD scene")),
    (b"ISO-10303-21", FileKind::OtherMesh("a STEP model")),
    (b"#VRML", FileKind::OtherMesh("a VRML scene")),
    (b"# .PCD", FileKind::OtherMesh("a PCD point cloud")),
    (b"LASF", FileKind::OtherMesh("a LAS point cloud")),
    (b"ASTM-E57", FileKind::OtherMesh("an E57 point cloud")),
    (b"version https://git-lfs", FileKind::LfsPointer),
    (b"version https://hawser", FileKind::LfsPointer),
    (
        b"/annex/objects/",
        FileKind::Other("a pointer of git-annex, whose content `git annex get` fetches"),
    ),
    (b"%PDF", FileKind::Other("a PDF document")),
    (b"PK\x03\x04", FileKind::Other("a ZIP archive")),
    (b"\x1f\x8b", FileKind::Other("a gzip archive")),
    (b"7z\xbc\xaf", FileKind::Other("a 7-Zip archive")),
    (b"Rar!", FileKind::Other("a RAR archive")),
    (b"SQLite format 3", FileKind::Other("an SQLite database")),
    (b"\xff\xfe", FileKind::Other("UTF-16 text")),
    (b"\xfe\xff", FileKind::Other("UTF-16 text")),
    (b"<", FileKind::Other("XML or HTML text")),
];

/// Extensions of unsupported 3D formats.
const UNREAD_MESHES: [(&[&str], FileKind); 14] = [
    (&["glb", "gltf"], GLTF),
    (&["off"], FileKind::OtherMesh("an OFF mesh")),
    (&["3mf"], FileKind::OtherMesh("a 3MF model")),
    (&["fbx"], FileKind::OtherMesh("an FBX scene")),
    (&["dae"], FileKind::OtherMesh("a COLLADA scene")),
    (&["3ds"], FileKind::OtherMesh("a 3DS scene")),
    (&["x3d"], FileKind::OtherMesh("an X3D scene")),
    (&["wrl"], FileKind::OtherMesh("a VRML scene")),
    (&["blend"], FileKind::OtherMesh("a Blender scene")),
    (
        &["usd", "usda", "usdc", "usdz"],
        FileKind::OtherMesh("a USD scene"),
    ),
    (&["step", "stp"], FileKind::OtherMesh("a STEP model")),
    (&["pcd"], FileKind::OtherMesh("a PCD point cloud")),
    (&["las", "laz"], FileKind::OtherMesh("a LAS point cloud")),
    (&["e57"], FileKind::OtherMesh("an E57 point cloud")),
];

/// Extensions of unsupported images and documents.
const UNREAD_IMAGES: [(&[&str], FileKind); 10] = [
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
    (&["svg"], SVG),
    (&["pdf"], FileKind::Other("a PDF document")),
];

const SVG: FileKind = FileKind::OtherImage("an SVG image");
const GLTF: FileKind = FileKind::OtherMesh("a glTF scene");
/// Bytes at the beginning and the end of a container that are searched for the name of its content.
const SEARCHED_BYTES: usize = 1 << 16;

/// Says that a file is a pointer of Git LFS and not what is `needed`, and what to do.
pub fn pointer_of(needed: &str) -> String {
    format!(
        "is {} and does not hold the {needed}; fetch the {needed} with `git lfs pull`",
        FileKind::LfsPointer
    )
}

impl FileKind {
    /// Returns the type of a file that begins with these bytes.
    pub fn of(bytes: &[u8]) -> Self {
        // Programs for text add a byte order mark to pointers that they save.
        let is_pointer = |text: &[u8]| {
            let mut signatures = SIGNATURES.iter();
            signatures
                .any(|(signature, kind)| *kind == Self::LfsPointer && text.starts_with(signature))
        };
        if bytes.strip_prefix(b"\xef\xbb\xbf").is_some_and(is_pointer) {
            return Self::LfsPointer;
        }
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
        if is_3ds(bytes) {
            return Self::OtherMesh("a 3DS scene");
        }
        let found = SIGNATURES
            .iter()
            .find(|(signature, kind)| bytes.starts_with(signature) && !is_text(kind, bytes))
            .map_or_else(|| Self::without_signature(bytes), |(_, kind)| *kind);
        Self::format_within(found, bytes).unwrap_or(found)
    }

    /// Returns the format of images or 3D files that are archives, XML or text.
    fn format_within(outer: Self, bytes: &[u8]) -> Option<Self> {
        let part = bytes.len().min(SEARCHED_BYTES);
        let (head, tail) = (&bytes[..part], &bytes[bytes.len() - part..]);
        let has = |word: &str| {
            let mut places = head.windows(word.len()).chain(tail.windows(word.len()));
            places.any(|place| place == word.as_bytes())
        };
        let name = match outer {
            Self::Other("a ZIP archive") if has("3D/3dmodel.model") => "a 3MF model",
            Self::Other("XML or HTML text") if has("<COLLADA") => "a COLLADA scene",
            Self::Other("XML or HTML text") if has("<X3D") => "an X3D scene",
            Self::Other("XML or HTML text") if has("<svg") && !has("<html") => return Some(SVG),
            Self::Text if is_off(head) => "an OFF mesh",
            Self::Text if head.trim_ascii_start().starts_with(b"{") => {
                return (has_gltf_asset(head) || has_gltf_asset(tail)).then_some(GLTF);
            }
            _ => return None,
        };
        Some(Self::OtherMesh(name))
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

    /// Returns whether files of this type must be unpacked.
    pub fn is_archive(self) -> bool {
        matches!(self, Self::Other(name) if name.ends_with(" archive"))
    }

    /// Returns the type that files with an extension usually are, if it is not read.
    pub fn of_unread_extension(extension: &str) -> Option<Self> {
        let extension = extension.to_ascii_lowercase();
        let mut types = UNREAD_MESHES.into_iter().chain(UNREAD_IMAGES);
        let found = types.find(|(extensions, _)| extensions.contains(&extension.as_str()));
        found.map(|(_, kind)| kind)
    }

    /// Returns the extensions of files that are not read, and for which there is advice.
    pub fn unread_extensions() -> impl Iterator<Item = &'static str> {
        let types = UNREAD_MESHES.into_iter().chain(UNREAD_IMAGES);
        types.flat_map(|(extensions, _)| extensions.iter().copied())
    }

    /// Returns what to do with files of this type where images are needed, if that does not depend on the file.
    pub fn image_advice(self) -> Option<String> {
        let mut images = UNREAD_IMAGES.into_iter();
        let (extensions, _) = images.find(|(_, kind)| *kind == self)?;
        let extension = extensions[0];
        Some(if extension == "pdf" {
            "open them in a program and save their pages as PNG; for many files: `pdftoppm -r 600 -png FILE.pdf page`"
                .to_owned()
        } else {
            format!(
                "open them in a program and save them as PNG; for many files, with ImageMagick: `magick mogrify -format png *.{extension}`"
            )
        })
    }

    /// Returns what to do with a file whose content is of this type where an image is needed. Its name may say otherwise.
    pub(crate) fn image_content_advice(self) -> Option<String> {
        let advice = self.image_advice()?;
        Some(match self {
            Self::OtherImage(_) => "convert it, such as with ImageMagick: `magick mogrify -format png FILE`, and use the new file"
                .to_owned(),
            _ => advice,
        })
    }

    /// Returns what to do with files of this type where meshes are needed, if that does not depend on the file.
    pub fn mesh_advice(self) -> Option<String> {
        let programs = match self {
            Self::OtherMesh("a STEP model") => "FreeCAD",
            Self::OtherMesh(_) => "MeshLab, Blender or CloudCompare",
            _ => return None,
        };
        Some(format!("open them in {programs} and export them as PLY"))
    }

    /// Says that a file of this type is not what is `needed`, which files of the `formats` that are read hold.
    pub(crate) fn refusal(self, needed: &str, formats: &str, advice: Option<String>) -> String {
        if self == Self::LfsPointer {
            return format!("the file {}", pointer_of(needed));
        }
        let advice = advice.map_or(String::new(), |advice| format!(": {advice}"));
        format!("the file is {self}; {formats} are read{advice}")
    }

    /// Returns the description without the article.
    pub fn name(self) -> &'static str {
        let text = self.description();
        let name = text.strip_prefix("a ").or(text.strip_prefix("an "));
        name.unwrap_or(text)
    }
}

/// Returns whether a text only begins like an image: the signatures of some images are few letters.
fn is_text(kind: &FileKind, bytes: &[u8]) -> bool {
    matches!(kind, FileKind::OtherImage(_)) && FileKind::without_signature(bytes) == FileKind::Text
}

/// Returns whether a file begins with a main chunk of 3DS, and in it with the chunk of its version or of its objects.
fn is_3ds(bytes: &[u8]) -> bool {
    let is_tiff = matches!(bytes.get(2..4), Some(b"\0*" | b"\0+"));
    let inner = bytes.get(6..8);
    bytes.starts_with(b"MM")
        && !is_tiff
        && bytes.get(5) == Some(&0)
        && matches!(inner, Some(b"\x02\0" | b"=="))
}

/// Returns whether a part of a JSON file has the member that each glTF scene has, an object `asset` with a `version`.
/// Labels of images and lists of pairs may have members of these names with other values.
fn has_gltf_asset(json: &[u8]) -> bool {
    const NAME: &[u8] = b"\"asset\"";
    const VERSION: &[u8] = b"\"version\"";
    let names = json.windows(NAME.len()).enumerate();
    let mut ends = names
        .filter(|(_, name)| *name == NAME)
        .map(|(at, _)| at + NAME.len());
    ends.any(|end| {
        let value = json[end..].trim_ascii_start();
        let value = value.strip_prefix(b":").unwrap_or_default();
        let Some(members) = value.trim_ascii_start().strip_prefix(b"{") else {
            return false;
        };
        let mut depth = 1;
        let is_inside = |byte: &&u8| {
            depth += i32::from(**byte == b'{') - i32::from(**byte == b'}');
            depth > 0
        };
        let length = members.iter().take_while(is_inside).count();
        let mut words = members[..length].windows(VERSION.len());
        words.any(|word| word == VERSION)
    })
}

/// Returns whether the first word of a text, which comments may precede, is `OFF` or names one of its variants.
fn is_off(text: &[u8]) -> bool {
    let mut lines = text.split(|byte| matches!(byte, b'\n' | b'\r'));
    let is_content = |line: &&[u8]| !line.trim_ascii().is_empty() && !line.starts_with(b"#");
    let first = lines.find(is_content).unwrap_or_default();
    let mut words = first.split(u8::is_ascii_whitespace);
    let Some(mut variant) = words.next().and_then(|word| word.strip_suffix(b"OFF")) else {
        return false;
    };
    for prefix in [&b"ST"[..], b"C", b"N", b"4", b"n"] {
        variant = variant.strip_prefix(prefix).unwrap_or(variant);
    }
    variant.is_empty()
}

impl std::fmt::Display for FileKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.description())
    }
}

#[cfg(test)]
mod tests;
