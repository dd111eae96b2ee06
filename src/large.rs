//! Vectors that may hold millions of numbers, on pages of memory of their own where they do, large ones if there are.
//!
//! The system clears memory page by page as it is first touched. For a vector of many megabytes that takes longer than
//! filling it, unless the pages are large; so pages that are not needed any more are kept for the next vector.

use std::fmt;
use std::io::{self, ErrorKind, Read};
use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, MutexGuard, PoisonError};

use bytemuck::Pod;
use memmap2::MmapMut;

/// Bytes from which on a vector lies on pages of its own.
const LARGE: usize = 1 << 20;
/// Most bytes of pages that are kept, by the whole program.
const MOST_KEPT: usize = 128 << 20;
/// Pages are not taken for a vector that needs less than one in so many of them.
const ROOMY: usize = 4;
/// So many bytes are kept although others are had of the system.
const FREELY: usize = 32 << 20;

/// Pages that are not needed any more.
struct Kept {
    /// The least first.
    pages: Vec<MmapMut>,
    /// Most bytes of them.
    most: usize,
}

static KEPT: Mutex<Kept> = Mutex::new(Kept {
    pages: Vec::new(),
    most: MOST_KEPT,
});

impl Kept {
    /// Those that fit so many bytes best. Else as many as make up for those that must be had of the system, which are to
    /// be given back: scans of one run differ in size, and one that is larger than all before must not add to them.
    fn take(&mut self, bytes: usize) -> Result<MmapMut, Vec<MmapMut>> {
        let fits = |pages: &MmapMut| (bytes..=bytes.saturating_mul(ROOMY)).contains(&pages.len());
        if let Some(found) = self.pages.iter().position(fits) {
            return Ok(self.pages.remove(found));
        }
        let mut over = (self.held() + bytes).saturating_sub(FREELY).min(bytes);
        let mut back = Vec::new();
        while over > 0
            && let Some(pages) = self.pages.pop()
        {
            over = over.saturating_sub(pages.len());
            back.push(pages);
        }
        Err(back)
    }

    /// Bytes of all.
    fn held(&self) -> usize {
        self.pages.iter().map(|pages| pages.len()).sum()
    }

    /// Keeps some; where that is too much, the least are to be given back.
    #[must_use = "what is given back is so when it is dropped"]
    fn put(&mut self, pages: MmapMut) -> Vec<MmapMut> {
        let place = self
            .pages
            .partition_point(|other| other.len() < pages.len());
        self.pages.insert(place, pages);
        let mut held = self.held();
        let back = self.pages.iter().take_while(|pages| {
            let is_over = held > self.most;
            held -= pages.len();
            is_over
        });
        let back = back.count();
        self.pages.drain(..back).collect()
    }
}

/// Those of the whole program. Nothing that can fail is done with them.
fn kept() -> MutexGuard<'static, Kept> {
    KEPT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Pages of memory that hold anything.
struct Pages(Option<MmapMut>);

impl Pages {
    /// For so many bytes; `None` where the system gives none.
    fn of(bytes: usize) -> Option<Self> {
        let found = kept().take(bytes);
        match found {
            Ok(pages) => return Some(Self(Some(pages))),
            Err(back) => drop(back),
        }
        let pages = MmapMut::map_anon(bytes).ok()?;
        #[cfg(target_os = "linux")]
        {
            // Where there are no large pages, small ones do.
            let _ = pages.advise(memmap2::Advice::HugePage);
        }
        Some(Self(Some(pages)))
    }
}

impl Drop for Pages {
    fn drop(&mut self) {
        if let Some(pages) = self.0.take() {
            let back = kept().put(pages);
            drop(back);
        }
    }
}

impl Deref for Pages {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.0.as_deref().unwrap_or_default()
    }
}

impl DerefMut for Pages {
    fn deref_mut(&mut self) -> &mut [u8] {
        self.0.as_deref_mut().unwrap_or_default()
    }
}

/// Makes the program keep memory from one pair to the next, but no more than an eighth of its limit: by so much at least
/// pairs are taken for larger than they are.
///
/// The allocator of glibc gives back what lies free at its end when that is more than twice the largest block it ever gave out
/// whole; the next stage of the next pair would have it cleared again. Nothing of this block is ever touched.
pub fn keep_memory(limit: Option<u64>) {
    const WHOLE: usize = 31 << 20;
    if let Some(limit) = limit {
        kept().most = MOST_KEPT.min(limit as usize / 8);
    }
    drop(std::hint::black_box(Vec::<u8>::with_capacity(WHOLE)));
}

/// A vector of plain numbers that may be large. What it cannot do a slice can, or [`Vec`] before it is turned into one.
pub struct Large<T>(Place<T>);

enum Place<T> {
    Small(Vec<T>),
    Pages { pages: Pages, len: usize },
}

impl<T: Pod> Large<T> {
    /// Without elements, and with room for so many.
    pub fn with_capacity(capacity: usize) -> Self {
        let bytes = capacity.saturating_mul(size_of::<T>());
        let is_large = cfg!(target_os = "linux") && bytes >= LARGE;
        let pages = is_large.then(|| Self::on_pages(bytes)).flatten();
        pages.unwrap_or_else(|| Self(Place::Small(Vec::with_capacity(capacity))))
    }

    /// On pages of its own; `None` where the system gives none.
    fn on_pages(bytes: usize) -> Option<Self> {
        let pages = Pages::of(bytes)?;
        Some(Self(Place::Pages { pages, len: 0 }))
    }

    /// How many elements there is room for.
    pub fn capacity(&self) -> usize {
        match &self.0 {
            Place::Small(vec) => vec.capacity(),
            Place::Pages { pages, .. } => pages.len() / size_of::<T>(),
        }
    }

    /// Adds an element at the end.
    #[inline]
    pub fn push(&mut self, element: T) {
        match &mut self.0 {
            Place::Small(vec) => vec.push(element),
            Place::Pages { .. } => self.push_on_pages(element),
        }
    }

    /// Apart, so that what is small is pushed without a call.
    #[inline(never)]
    fn push_on_pages(&mut self, element: T) {
        if let Place::Pages { pages, len } = &mut self.0
            && let Some(place) = slots(pages).get_mut(*len)
        {
            *place = element;
            *len += 1;
        } else {
            self.grow();
            self.push(element);
        }
    }

    /// Adds elements at the end.
    pub fn extend_from_slice(&mut self, elements: &[T]) {
        match &mut self.0 {
            Place::Small(vec) => vec.extend_from_slice(elements),
            Place::Pages { pages, len } => {
                if let Some(room) = slots(pages)[*len..].get_mut(..elements.len()) {
                    room.copy_from_slice(elements);
                    *len += elements.len();
                } else {
                    self.extend(elements.iter().copied());
                }
            }
        }
    }

    /// Makes twice the room.
    fn grow(&mut self) {
        let mut larger = Self::with_capacity(2 * self.capacity().max(1));
        larger.extend_from_slice(self);
        *self = larger;
    }
}

impl Large<u8> {
    /// All bytes to the end, of which there are about so many.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn read(mut from: impl Read, about: usize) -> io::Result<Self> {
        let mut bytes = Self::with_capacity(about);
        match &mut bytes.0 {
            Place::Small(vec) => {
                from.read_to_end(vec)?;
            }
            Place::Pages { pages, len } => {
                while *len < pages.len() {
                    match from.read(&mut pages[*len..]) {
                        Ok(0) => return Ok(bytes),
                        Ok(more) => *len += more,
                        Err(error) if error.kind() == ErrorKind::Interrupted => {}
                        Err(error) => return Err(error),
                    }
                }
                let mut rest = Vec::new();
                from.read_to_end(&mut rest)?;
                bytes.extend(rest);
            }
        }
        Ok(bytes)
    }
}

/// Pages as elements; what is left of their end is none.
fn slots<T: Pod>(pages: &mut Pages) -> &mut [T] {
    let whole = pages.len() - pages.len() % size_of::<T>();
    bytemuck::cast_slice_mut(&mut pages[..whole])
}

impl<T: Pod> Deref for Large<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        match &self.0 {
            Place::Small(vec) => vec,
            Place::Pages { pages, len } => bytemuck::cast_slice(&pages[..len * size_of::<T>()]),
        }
    }
}

impl<T: Pod> DerefMut for Large<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        match &mut self.0 {
            Place::Small(vec) => vec,
            Place::Pages { pages, len } => &mut slots(pages)[..*len],
        }
    }
}

impl<T: Pod> Extend<T> for Large<T> {
    fn extend<I: IntoIterator<Item = T>>(&mut self, elements: I) {
        let mut elements = elements.into_iter();
        match &mut self.0 {
            Place::Small(vec) => return vec.extend(elements),
            Place::Pages { pages, len } => {
                for place in &mut slots(pages)[*len..] {
                    let Some(element) = elements.next() else {
                        return;
                    };
                    *place = element;
                    *len += 1;
                }
            }
        }
        elements.for_each(|element| self.push(element));
    }
}

impl<T: Pod> FromIterator<T> for Large<T> {
    fn from_iter<I: IntoIterator<Item = T>>(elements: I) -> Self {
        let elements = elements.into_iter();
        let mut large = Self::with_capacity(elements.size_hint().0);
        large.extend(elements);
        large
    }
}

impl<T> From<Vec<T>> for Large<T> {
    fn from(vec: Vec<T>) -> Self {
        Self(Place::Small(vec))
    }
}

impl<T> Default for Large<T> {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl<T: Pod> Clone for Large<T> {
    fn clone(&self) -> Self {
        self.iter().copied().collect()
    }
}

impl<T: Pod + PartialEq> PartialEq for Large<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: Pod + PartialEq, const N: usize> PartialEq<[T; N]> for Large<T> {
    fn eq(&self, other: &[T; N]) -> bool {
        **self == *other
    }
}

impl<T: Pod + fmt::Debug> fmt::Debug for Large<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

impl<'a, T: Pod> IntoIterator for &'a Large<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<'a, T: Pod> IntoIterator for &'a mut Large<T> {
    type Item = &'a mut T;
    type IntoIter = std::slice::IterMut<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{Kept, LARGE, Large, MOST_KEPT, MmapMut, Place};

    type Element = [u32; 3];

    #[test]
    fn what_is_large_lies_on_pages_of_its_own() {
        let count = LARGE / size_of::<Element>() + 1;
        let is_on_pages = |count| {
            let empty = Large::<Element>::with_capacity(count);
            assert!(empty.is_empty() && empty.capacity() >= count);
            matches!(empty.0, Place::Pages { .. })
        };
        assert_eq!(is_on_pages(count), cfg!(target_os = "linux"));
        assert!(!is_on_pages(9));
    }

    #[test]
    fn pages_that_fit_are_used_again_and_none_beyond_the_limit_are_kept() {
        let mut kept = Kept {
            pages: Vec::new(),
            most: MOST_KEPT,
        };
        let pages = |mebibytes: usize| MmapMut::map_anon(mebibytes << 20).expect("pages");
        let held = |kept: &Kept| {
            kept.pages
                .iter()
                .map(|pages| pages.len() >> 20)
                .collect::<Vec<_>>()
        };
        for mebibytes in [30, 2, 11, 13] {
            assert!(kept.put(pages(mebibytes)).is_empty());
        }
        let fitting = kept.take((11 << 20) - 5).expect("pages");
        assert_eq!(fitting.len(), 11 << 20);
        assert_eq!(held(&kept), [2, 13, 30]);
        assert_eq!(kept.put(pages(90)).len(), 2);
        assert_eq!(held(&kept), [30, 90]);
        assert_eq!(kept.put(pages(8)).len(), 0);
        let too_large = kept.take(4096).expect_err("too large for so little");
        assert_eq!(too_large[0].len(), 90 << 20);
        let too_small = kept.take(50 << 20).expect_err("all are too small");
        assert_eq!((too_small.len(), held(&kept)), (2, Vec::new()));
        assert!(kept.put(pages(3)).is_empty());
        let few = kept.take(14 << 20).expect_err("too small");
        assert_eq!((few.len(), held(&kept)), (0, vec![3]));
        assert_eq!(kept.put(pages(200)).len(), 2);
    }

    #[test]
    fn what_was_longer_or_shorter_than_told_is_read_whole() {
        let source: Vec<u8> = (0..LARGE + 9).map(|k| (k % 251) as u8).collect();
        for (len, told) in [(5, 0), (5, 9), (LARGE, LARGE + 7), (LARGE + 9, LARGE)] {
            let read = Large::read(&source[..len], told).expect("memory refuses nothing");
            assert!(*read == source[..len], "{len} {told}");
        }
    }

    proptest! {
        #[test]
        fn pages_hold_what_a_vector_holds(
            room in 12_usize..200,
            first: Vec<Element>,
            more: Vec<Element>,
        ) {
            let mut pages = Large::on_pages(room).expect("a page");
            let mut vec = Vec::new();
            for element in first {
                pages.push(element);
                vec.push(element);
            }
            pages.extend(more.iter().copied());
            vec.extend(more);
            prop_assert!(pages.capacity() >= pages.len());
            for (one, other) in pages.iter_mut().zip(&mut vec) {
                one[1] ^= 7;
                other[1] ^= 7;
            }
            prop_assert_eq!(&*pages, &*vec);
            prop_assert_eq!(&pages, &Large::from(vec));
            prop_assert_eq!(&pages.clone(), &pages);
        }
    }
}
