//! Vectors that may hold millions of numbers, on pages of memory of their own where they do, large ones if there are.
//!
//! The system clears memory page by page as it is first touched. For a vector of many megabytes that takes longer than
//! filling it, unless the pages are large; so pages that are not needed any more are kept for the next vector.

mod page_cache;

use std::fmt;
use std::io::{self, ErrorKind, Read};
use std::ops::{Deref, DerefMut};

use bytemuck::Pod;

use page_cache::PageBuffer;
pub use page_cache::keep_memory;

/// Bytes from which on a vector lies on pages of its own.
const LARGE: usize = 1 << 20;
/// A vector of plain numbers that may be large. What it cannot do a slice can, or [`Vec`] before it is turned into one.
pub struct PageVec<T>(Place<T>);

enum Place<T> {
    Small(Vec<T>),
    PageBuffer { pages: PageBuffer, len: usize },
}

impl<T: Pod> PageVec<T> {
    /// Without elements, and with room for so many.
    pub fn with_capacity(capacity: usize) -> Self {
        let bytes = capacity.saturating_mul(size_of::<T>());
        let is_large = cfg!(target_os = "linux") && bytes >= LARGE;
        let pages = is_large.then(|| Self::on_pages(bytes)).flatten();
        pages.unwrap_or_else(|| Self(Place::Small(Vec::with_capacity(capacity))))
    }

    /// On pages of its own; `None` where the system gives none.
    fn on_pages(bytes: usize) -> Option<Self> {
        let pages = PageBuffer::of(bytes)?;
        Some(Self(Place::PageBuffer { pages, len: 0 }))
    }

    /// How many elements there is room for.
    pub fn capacity(&self) -> usize {
        match &self.0 {
            Place::Small(vec) => vec.capacity(),
            Place::PageBuffer { pages, .. } => pages.len() / size_of::<T>(),
        }
    }

    /// Adds an element at the end.
    #[inline]
    pub fn push(&mut self, element: T) {
        match &mut self.0 {
            Place::Small(vec) => vec.push(element),
            Place::PageBuffer { .. } => self.push_on_pages(element),
        }
    }

    /// Apart, so that what is small is pushed without a call.
    #[inline(never)]
    fn push_on_pages(&mut self, element: T) {
        if let Place::PageBuffer { pages, len } = &mut self.0
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
            Place::PageBuffer { pages, len } => {
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

impl PageVec<u8> {
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
            Place::PageBuffer { pages, len } => {
                *len = fill(&mut from, pages)?;
                if *len == pages.len() {
                    let mut rest = Vec::new();
                    from.read_to_end(&mut rest)?;
                    bytes.extend(rest);
                }
            }
        }
        Ok(bytes)
    }
}

/// Reads until some bytes are full or the source ends; says how many are.
///
/// # Errors
/// When the source fails.
pub fn fill(source: &mut impl Read, bytes: &mut [u8]) -> io::Result<usize> {
    let mut full = 0;
    while full < bytes.len() {
        match source.read(&mut bytes[full..]) {
            Ok(0) => break,
            Ok(more) => full += more,
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(full)
}

/// Pages as elements; what is left of their end is none.
fn slots<T: Pod>(pages: &mut PageBuffer) -> &mut [T] {
    let whole = pages.len() - pages.len() % size_of::<T>();
    bytemuck::cast_slice_mut(&mut pages[..whole])
}

impl<T: Pod> Deref for PageVec<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        match &self.0 {
            Place::Small(vec) => vec,
            Place::PageBuffer { pages, len } => {
                bytemuck::cast_slice(&pages[..len * size_of::<T>()])
            }
        }
    }
}

impl<T: Pod> DerefMut for PageVec<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        match &mut self.0 {
            Place::Small(vec) => vec,
            Place::PageBuffer { pages, len } => &mut slots(pages)[..*len],
        }
    }
}

impl<T: Pod> Extend<T> for PageVec<T> {
    fn extend<I: IntoIterator<Item = T>>(&mut self, elements: I) {
        let mut elements = elements.into_iter();
        match &mut self.0 {
            Place::Small(vec) => return vec.extend(elements),
            Place::PageBuffer { pages, len } => {
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

impl<T: Pod> FromIterator<T> for PageVec<T> {
    fn from_iter<I: IntoIterator<Item = T>>(elements: I) -> Self {
        let elements = elements.into_iter();
        let mut large = Self::with_capacity(elements.size_hint().0);
        large.extend(elements);
        large
    }
}

impl<T> From<Vec<T>> for PageVec<T> {
    fn from(vec: Vec<T>) -> Self {
        Self(Place::Small(vec))
    }
}

impl<T> Default for PageVec<T> {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl<T: Pod> Clone for PageVec<T> {
    fn clone(&self) -> Self {
        self.iter().copied().collect()
    }
}

impl<T: Pod + PartialEq> PartialEq for PageVec<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: Pod + PartialEq, const N: usize> PartialEq<[T; N]> for PageVec<T> {
    fn eq(&self, other: &[T; N]) -> bool {
        **self == *other
    }
}

impl<T: Pod + fmt::Debug> fmt::Debug for PageVec<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

impl<'a, T: Pod> IntoIterator for &'a PageVec<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<'a, T: Pod> IntoIterator for &'a mut PageVec<T> {
    type Item = &'a mut T;
    type IntoIter = std::slice::IterMut<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{LARGE, PageVec, Place};

    type Element = [u32; 3];

    #[test]
    fn what_is_large_lies_on_pages_of_its_own() {
        let count = LARGE / size_of::<Element>() + 1;
        let is_on_pages = |count| {
            let empty = PageVec::<Element>::with_capacity(count);
            assert!(empty.is_empty() && empty.capacity() >= count);
            matches!(empty.0, Place::PageBuffer { .. })
        };
        assert_eq!(is_on_pages(count), cfg!(target_os = "linux"));
        assert!(!is_on_pages(9));
    }

    #[test]
    fn what_was_longer_or_shorter_than_told_is_read_whole() {
        let source: Vec<u8> = (0..LARGE + 9).map(|k| (k % 251) as u8).collect();
        for (len, told) in [(5, 0), (5, 9), (LARGE, LARGE + 7), (LARGE + 9, LARGE)] {
            let read = PageVec::read(&source[..len], told).expect("memory refuses nothing");
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
            let mut pages = PageVec::on_pages(room).expect("a page");
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
            prop_assert_eq!(&pages, &PageVec::from(vec));
            prop_assert_eq!(&pages.clone(), &pages);
        }
    }
}
