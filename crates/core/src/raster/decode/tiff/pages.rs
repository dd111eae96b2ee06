//! The pages of a TIFF file: chooses the one page of a print.

use crate::domain::FileKind;
use crate::raster::decode::error::{DecodeError, broken};
use crate::raster::decode::orientation::{ORIENTATION, xmp_number};
use crate::raster::decode::tags::{TagDirectory, TagSource, TagValues, TaggedFile};

/// Flags of `NewSubfileType`: a reduced copy of another page, and a mask.
const REDUCED: u64 = 1;
const MASK: u64 = 4;
/// Value of the older `SubfileType` for a reduced copy of another page.
const OLD_REDUCED: u64 = 2;
/// Most pages that are counted.
const MAX_PAGES: usize = 1000;
/// Most levels of subdirectories below the subdirectories of a page.
const MAX_DEPTH: usize = 4;

const NEW_SUBFILE_TYPE: u64 = 254;
const SUBFILE_TYPE: u64 = 255;
const WIDTH: u64 = 256;
const HEIGHT: u64 = 257;
const SUB_DIRECTORIES: u64 = 330;
const XMP: u64 = 700;

/// Bytes at the beginning of XMP in which an orientation is searched.
const MAX_XMP_BYTES: usize = 1 << 20;

/// The page of a print.
#[derive(Clone, Copy)]
pub(in crate::raster::decode) struct PrintPage<'b> {
    pub(super) page: TagDirectory<'b>,
    /// If it is a subdirectory, the page that refers to it, and the page at the top, which may be the same. Metadata of the
    /// picture may be there.
    parents: Option<[TagDirectory<'b>; 2]>,
}

impl<'b> PrintPage<'b> {
    /// Returns the EXIF orientation of the page, or of its parents: that of the tag, or else that in XMP.
    pub(in crate::raster::decode) fn orientation(&self) -> Option<u64> {
        let stated = self.inherited(ORIENTATION);
        let valid = stated.filter(|number| (1..=8).contains(number));
        valid.or_else(|| xmp_number(&self.inherited_values(XMP)?.first_bytes(MAX_XMP_BYTES)?))
    }

    /// Returns the first value of a tag of the page, or of its parents.
    fn inherited(&self, tag: u64) -> Option<u64> {
        let own = self.page.number(tag);
        own.or_else(|| self.parents?.iter().find_map(|parent| parent.number(tag)))
    }

    /// Returns the bytes of a tag of the page, or of its parents.
    pub(super) fn inherited_bytes(&self, tag: u64) -> Option<&'b [u8]> {
        self.inherited_values(tag)?.bytes()
    }

    /// Returns the values of a tag of the page, or of its parents.
    pub(in crate::raster::decode) fn inherited_values(&self, tag: u64) -> Option<TagValues<'b>> {
        let own = self.page.values(tag);
        own.or_else(|| self.parents?.iter().find_map(|parent| parent.values(tag)))
    }
}

/// Returns whether a page is a reduced copy or a mask of another page.
fn is_auxiliary(page: &TagDirectory<'_>) -> bool {
    let flags = page.number(NEW_SUBFILE_TYPE).unwrap_or(0);
    flags & (REDUCED | MASK) != 0 || page.number(SUBFILE_TYPE) == Some(OLD_REDUCED)
}

/// Returns the number of pixels of a page.
pub(super) fn pixel_count(page: &TagDirectory<'_>) -> u64 {
    let [width, height] = [WIDTH, HEIGHT].map(|tag| page.number(tag).unwrap_or(0));
    width.saturating_mul(height)
}

/// The pages that are found so far.
#[derive(Default)]
struct FoundPages<'b> {
    count: usize,
    full: Vec<PrintPage<'b>>,
}

impl<'b> FoundPages<'b> {
    /// Counts a page.
    ///
    /// # Errors
    /// Returns an error if there are too many, as in a file whose pages refer to each other.
    fn count(&mut self) -> Result<(), DecodeError> {
        self.count += 1;
        if self.count > MAX_PAGES {
            let reason = format!("it has more than {MAX_PAGES} pages; a print is one page");
            return Err(broken(FileKind::Tiff, &reason));
        }
        Ok(())
    }

    /// Adds a page, or the full pictures of which it is a preview: cameras and Photoshop store them in subdirectories.
    fn add(&mut self, page: TagDirectory<'b>) -> Result<(), DecodeError> {
        self.count()?;
        let mut larger = Vec::new();
        self.find_larger([page; 2], 0, &mut larger)?;
        if larger.is_empty() && !is_auxiliary(&page) {
            let parents = None;
            self.full.push(PrintPage { page, parents });
        }
        self.full.extend(larger);
        Ok(())
    }

    /// Finds full pictures in the subdirectories of a page, and in theirs. `parents` are this page and the one at the top.
    fn find_larger(
        &mut self,
        parents: [TagDirectory<'b>; 2],
        depth: usize,
        larger: &mut Vec<PrintPage<'b>>,
    ) -> Result<(), DecodeError> {
        let [page, top] = parents;
        let of_same = if is_auxiliary(&page) { top } else { page };
        let offsets = page.values(SUB_DIRECTORIES);
        for offset in offsets.iter().flat_map(|offsets| offsets.iter().flatten()) {
            self.count()?;
            let Some(picture) = page.file.directory_at(offset) else {
                continue;
            };
            let is_larger = is_auxiliary(&of_same) || pixel_count(&picture) > pixel_count(&of_same);
            if !is_auxiliary(&picture) && is_larger {
                let parents = Some(parents);
                larger.push(PrintPage {
                    page: picture,
                    parents,
                });
            }
            if depth < MAX_DEPTH {
                self.find_larger([picture, top], depth + 1, larger)?;
            }
        }
        Ok(())
    }

    /// Drops pages of which both sides are at most half of those of the largest page: many programs do not mark previews.
    fn drop_previews(&mut self) {
        let sides =
            |page: &TagDirectory<'_>| [WIDTH, HEIGHT].map(|tag| page.number(tag).unwrap_or(0));
        let largest = self
            .full
            .iter()
            .max_by_key(|found| pixel_count(&found.page));
        let Some(largest) = largest.map(|found| sides(&found.page)) else {
            return;
        };
        self.full.retain(|found| {
            let halves = sides(&found.page).map(|side| side.saturating_mul(2));
            halves[0] > largest[0] || halves[1] > largest[1]
        });
    }
}

/// Finds the only full page of a file. Skips reduced copies, also unmarked ones, and masks, but accepts any single page.
///
/// # Errors
/// Returns an error if several pages are full, because only the user knows which one is the print. Also returns an
/// error if none of several pages is full, or if a page cannot be read.
pub(super) fn find_print_page(bytes: &dyn TagSource) -> Result<PrintPage<'_>, DecodeError> {
    let truncated = || DecodeError::Truncated(FileKind::Tiff);
    let file = TaggedFile::new(bytes).ok_or_else(truncated)?;
    let first = file.first_directory().ok_or_else(truncated)?;
    let (mut page, mut found) = (first, FoundPages::default());
    loop {
        found.add(page)?;
        match page.next_offset().ok_or_else(truncated)? {
            0 => break,
            offset => page = file.directory_at(offset).ok_or_else(truncated)?,
        }
    }
    found.drop_previews();
    match found.full[..] {
        [print] => Ok(print),
        // The only page is marked as a copy or a mask.
        [] if found.count == 1 => Ok(PrintPage {
            page: first,
            parents: None,
        }),
        _ => Err(DecodeError::Pages {
            full: found.full.len(),
            count: found.count,
        }),
    }
}
