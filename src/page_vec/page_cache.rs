//! Cache of memory pages, reused from one vector to the next.

use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, MutexGuard, PoisonError};

use memmap2::MmapMut;

/// Most bytes in the cache of the process.
const MAX_CACHED_BYTES: usize = 128 << 20;
/// A vector uses cached pages of at most this many times its size.
const MAX_OVERSIZE: usize = 4;
/// Cache up to this many bytes even when new pages are taken from the system.
const MIN_CACHED_BYTES: usize = 32 << 20;

/// Pages that are free.
struct PageCache {
    /// In ascending order of size.
    pages: Vec<MmapMut>,
    /// Most bytes in the cache.
    max_bytes: usize,
}

static PAGE_CACHE: Mutex<PageCache> = Mutex::new(PageCache {
    pages: Vec::new(),
    max_bytes: MAX_CACHED_BYTES,
});

impl PageCache {
    /// Returns the pages that fit best. If none fit, returns as many others as offset the new pages, to be freed:
    /// scans of one run differ in size, and one that is larger than all before must not add to them.
    fn take(&mut self, bytes: usize) -> Result<MmapMut, Vec<MmapMut>> {
        let fits =
            |pages: &MmapMut| (bytes..=bytes.saturating_mul(MAX_OVERSIZE)).contains(&pages.len());
        if let Some(found) = self.pages.iter().position(fits) {
            return Ok(self.pages.remove(found));
        }
        let mut over = (self.bytes_cached() + bytes)
            .saturating_sub(MIN_CACHED_BYTES)
            .min(bytes);
        let mut to_free = Vec::new();
        while over > 0
            && let Some(pages) = self.pages.pop()
        {
            over = over.saturating_sub(pages.len());
            to_free.push(pages);
        }
        Err(to_free)
    }

    /// Returns the bytes in the cache.
    fn bytes_cached(&self) -> usize {
        self.pages.iter().map(|pages| pages.len()).sum()
    }

    /// Adds pages; returns the smallest ones, to be freed, if the cache is full.
    #[must_use = "pages are freed when they are dropped"]
    fn put(&mut self, pages: MmapMut) -> Vec<MmapMut> {
        let place = self
            .pages
            .partition_point(|other| other.len() < pages.len());
        self.pages.insert(place, pages);
        let mut bytes_cached = self.bytes_cached();
        let to_free = self.pages.iter().take_while(|pages| {
            let is_over = bytes_cached > self.max_bytes;
            bytes_cached -= pages.len();
            is_over
        });
        let to_free = to_free.count();
        self.pages.drain(..to_free).collect()
    }
}

/// Returns the cache of the process. A poisoned lock is harmless: no operation can leave the cache inconsistent.
fn cache() -> MutexGuard<'static, PageCache> {
    PAGE_CACHE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Pages of memory with arbitrary content.
pub(super) struct PageBuffer(Option<MmapMut>);

impl PageBuffer {
    /// Returns at least `bytes` bytes of pages; `None` if the system has none.
    pub(super) fn allocate(bytes: usize) -> Option<Self> {
        let found = cache().take(bytes);
        match found {
            Ok(pages) => return Some(Self(Some(pages))),
            Err(to_free) => drop(to_free),
        }
        let pages = MmapMut::map_anon(bytes).ok()?;
        #[cfg(target_os = "linux")]
        {
            // Without huge pages, small ones are used.
            let _ = pages.advise(memmap2::Advice::HugePage);
        }
        Some(Self(Some(pages)))
    }
}

impl Drop for PageBuffer {
    fn drop(&mut self) {
        if let Some(pages) = self.0.take() {
            let to_free = cache().put(pages);
            drop(to_free);
        }
    }
}

impl Deref for PageBuffer {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.0.as_deref().unwrap_or_default()
    }
}

impl DerefMut for PageBuffer {
    fn deref_mut(&mut self) -> &mut [u8] {
        self.0.as_deref_mut().unwrap_or_default()
    }
}

/// Makes the process keep freed memory between pairs; at most an eighth of `limit` bytes as cached pages.
///
/// The allocator of glibc returns free memory at the end of the heap to the system once it exceeds twice the largest
/// block that was ever mapped and freed. Allocating and freeing one large block raises that threshold; its memory is
/// never touched.
pub fn keep_memory(limit: Option<u64>) {
    const WHOLE: usize = 31 << 20;
    if let Some(limit) = limit {
        cache().max_bytes = MAX_CACHED_BYTES.min(limit as usize / 8);
    }
    drop(std::hint::black_box(Vec::<u8>::with_capacity(WHOLE)));
}

#[cfg(test)]
mod tests {
    use super::{MAX_CACHED_BYTES, MmapMut, PageCache};

    #[test]
    fn pages_that_fit_are_used_again_and_none_beyond_the_limit_are_kept() {
        let mut cache = PageCache {
            pages: Vec::new(),
            max_bytes: MAX_CACHED_BYTES,
        };
        let pages = |mebibytes: usize| MmapMut::map_anon(mebibytes << 20).expect("pages");
        let bytes_cached = |cache: &PageCache| {
            cache
                .pages
                .iter()
                .map(|pages| pages.len() >> 20)
                .collect::<Vec<_>>()
        };
        for mebibytes in [30, 2, 11, 13] {
            assert!(cache.put(pages(mebibytes)).is_empty());
        }
        let fitting = cache.take((11 << 20) - 5).expect("pages");
        assert_eq!(fitting.len(), 11 << 20);
        assert_eq!(bytes_cached(&cache), [2, 13, 30]);
        assert_eq!(cache.put(pages(90)).len(), 2);
        assert_eq!(bytes_cached(&cache), [30, 90]);
        assert_eq!(cache.put(pages(8)).len(), 0);
        let too_large = cache.take(4096).expect_err("too large for so little");
        assert_eq!(too_large[0].len(), 90 << 20);
        let too_small = cache.take(50 << 20).expect_err("all are too small");
        assert_eq!((too_small.len(), bytes_cached(&cache)), (2, Vec::new()));
        assert!(cache.put(pages(3)).is_empty());
        let few = cache.take(14 << 20).expect_err("too small");
        assert_eq!((few.len(), bytes_cached(&cache)), (0, vec![3]));
        assert_eq!(cache.put(pages(200)).len(), 2);
    }
}
