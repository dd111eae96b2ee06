//! Pages of memory, kept from one vector to the next.

use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, MutexGuard, PoisonError};

use memmap2::MmapMut;

/// Most bytes of pages that are kept, by the whole program.
const MOST_KEPT: usize = 128 << 20;
/// Pages are not taken for a vector that needs less than one in so many of them.
const ROOMY: usize = 4;
/// So many bytes are kept although others are had of the system.
const FREELY: usize = 32 << 20;

/// Pages that are not needed any more.
struct PageCache {
    /// The least first.
    pages: Vec<MmapMut>,
    /// Most bytes of them.
    most: usize,
}

static PAGE_CACHE: Mutex<PageCache> = Mutex::new(PageCache {
    pages: Vec::new(),
    most: MOST_KEPT,
});

impl PageCache {
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
fn kept() -> MutexGuard<'static, PageCache> {
    PAGE_CACHE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Pages of memory that hold anything.
pub(super) struct PageBuffer(Option<MmapMut>);

impl PageBuffer {
    /// For so many bytes; `None` where the system gives none.
    pub(super) fn of(bytes: usize) -> Option<Self> {
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

impl Drop for PageBuffer {
    fn drop(&mut self) {
        if let Some(pages) = self.0.take() {
            let back = kept().put(pages);
            drop(back);
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

/// Makes the program keep memory from one pair to the next; of pages no more than an eighth of its limit.
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

#[cfg(test)]
mod tests {
    use super::{MOST_KEPT, MmapMut, PageCache};

    #[test]
    fn pages_that_fit_are_used_again_and_none_beyond_the_limit_are_kept() {
        let mut kept = PageCache {
            pages: Vec::new(),
            most: MOST_KEPT,
        };
        let pages = |mebibytes: usize| MmapMut::map_anon(mebibytes << 20).expect("pages");
        let held = |kept: &PageCache| {
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
}
