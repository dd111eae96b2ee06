//! Cache of memory pages, reused from one vector to the next.

use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, MutexGuard};

use memmap2::MmapMut;

use crate::locked::locked;

/// The cache of the process holds at most this many bytes.
const MAX_CACHED_BYTES: usize = 128 << 20;
/// The same for a process that keeps few pages.
const MAX_CACHED_OF_SERVER: usize = 8 << 20;
/// A vector uses cached pages of at most this many times its size.
const MAX_OVERSIZE: usize = 4;
/// Before a new allocation, cached pages are freed only if they and the new pages need more bytes than this.
const KEPT_BYTES: usize = 32 << 20;

/// Pages that are free.
struct PageCache {
    /// In ascending order of size.
    pages: Vec<MmapMut>,
    max_bytes: usize,
}

static PAGE_CACHE: Mutex<PageCache> = Mutex::new(PageCache {
    pages: Vec::new(),
    max_bytes: MAX_CACHED_BYTES,
});

impl PageCache {
    /// Removes and returns the smallest cached pages that fit. If none fit, returns `None` and frees cached pages, up
    /// to about the size that the caller then allocates. Memory use therefore hardly grows.
    fn take(&mut self, bytes: usize) -> Option<MmapMut> {
        let sizes = bytes..=bytes.saturating_mul(MAX_OVERSIZE);
        let fits = |pages: &MmapMut| sizes.contains(&pages.len());
        if let Some(found) = self.pages.iter().position(fits) {
            return Some(self.pages.remove(found));
        }
        let over = (self.bytes_cached() + bytes).saturating_sub(KEPT_BYTES);
        let mut over = over.min(bytes);
        while over > 0
            && let Some(pages) = self.pages.pop()
        {
            over = over.saturating_sub(pages.len());
        }
        None
    }

    /// Returns the bytes in the cache.
    fn bytes_cached(&self) -> usize {
        self.pages.iter().map(|pages| pages.len()).sum()
    }

    /// Adds pages; frees the smallest ones while the cache is too large.
    fn put(&mut self, pages: MmapMut) {
        let size = pages.len();
        let place = self.pages.partition_point(|other| other.len() < size);
        self.pages.insert(place, pages);
        while self.bytes_cached() > self.max_bytes {
            self.pages.remove(0);
        }
    }
}

/// Returns the cache of the process.
fn cache() -> MutexGuard<'static, PageCache> {
    locked(&PAGE_CACHE)
}

/// Pages of memory with arbitrary content.
pub(super) struct PageBuffer(Option<MmapMut>);

impl PageBuffer {
    /// Returns pages of at least `bytes` bytes, or `None` if the system cannot provide any.
    pub(super) fn allocate(bytes: usize) -> Option<Self> {
        let found = cache().take(bytes);
        if found.is_some() {
            return Some(Self(found));
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
            cache().put(pages);
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

/// Makes the process keep few freed pages. For programs that read a scan now and then and otherwise wait.
pub fn keep_few_pages() {
    cache().max_bytes = MAX_CACHED_OF_SERVER;
}

/// Makes the process keep freed memory between pairs. Cached pages take at most an eighth of `limit` bytes.
///
/// The allocator of glibc returns free memory at the end of the heap to the system if it exceeds a threshold: twice the
/// largest block that was ever mapped and freed. Allocating and freeing one large block raises the threshold. The
/// memory of this block is never touched.
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
    fn fitting_pages_are_reused_and_the_cache_stays_within_its_limit() {
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
            cache.put(pages(mebibytes));
        }
        let fitting = cache.take((11 << 20) - 5).expect("pages");
        assert_eq!(fitting.len(), 11 << 20);
        assert_eq!(bytes_cached(&cache), [2, 13, 30]);
        cache.put(pages(90));
        assert_eq!(bytes_cached(&cache), [30, 90]);
        cache.put(pages(8));
        assert_eq!(bytes_cached(&cache), [8, 30, 90]);
        assert!(cache.take(4096).is_none(), "all are too large");
        assert_eq!(bytes_cached(&cache), [8, 30]);
        assert!(cache.take(50 << 20).is_none(), "all are too small");
        assert!(bytes_cached(&cache).is_empty());
        cache.put(pages(3));
        assert!(cache.take(14 << 20).is_none(), "too small");
        assert_eq!(bytes_cached(&cache), [3]);
        cache.put(pages(200));
        assert!(bytes_cached(&cache).is_empty());
    }
}
