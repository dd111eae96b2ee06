//! Cached values by a key, limited by their size.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use tokio::sync::OnceCell;

/// Values that are created once per key.
pub(super) type Slot<T> = Arc<OnceCell<Arc<T>>>;

/// Cache entries by a key. The oldest entry is evicted first.
#[derive(Debug)]
pub(super) struct CacheSlots<T> {
    /// Most bytes of all values. Most items have images of 100 to 500 KB.
    max_bytes: usize,
    slots: BTreeMap<String, Slot<T>>,
    /// Keys with a value and the bytes of the value, oldest first.
    stored: VecDeque<(String, usize)>,
}

impl<T> CacheSlots<T> {
    /// Creates an empty cache for this number of bytes.
    pub(super) const fn new(max_bytes: usize) -> Self {
        Self {
            max_bytes,
            slots: BTreeMap::new(),
            stored: VecDeque::new(),
        }
    }

    /// Returns the entry of a key, which may have no value yet.
    pub(super) fn entry(&mut self, id: &str) -> Slot<T> {
        Arc::clone(self.slots.entry(id.to_owned()).or_default())
    }

    /// Records the size of a new value. Evicts the oldest values until all values fit.
    pub(super) fn add(&mut self, id: &str, bytes: usize) {
        self.stored.push_back((id.to_owned(), bytes));
        let mut sum: usize = self.stored.iter().map(|(_, bytes)| bytes).sum();
        while sum > self.max_bytes
            && let Some((oldest, bytes)) = self.stored.pop_front()
        {
            self.slots.remove(&oldest);
            sum -= bytes;
        }
    }

    /// Removes an entry without a value, unless another request waits for it.
    pub(super) fn remove_failed(&mut self, id: &str, slot: Slot<T>) {
        drop(slot);
        if let Some(slot) = self.slots.get(id)
            && slot.get().is_none()
            && Arc::strong_count(slot) == 1
        {
            self.slots.remove(id);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::CacheSlots;

    const MAX_BYTES: usize = 64 << 20;

    #[test]
    fn the_oldest_values_are_evicted_if_all_have_too_many_bytes() {
        let mut slots = CacheSlots::<()>::new(MAX_BYTES);
        let half = MAX_BYTES / 2;
        for (id, bytes) in [("a", 1), ("b", half), ("c", half)] {
            slots.entry(id).set(Arc::new(())).expect("a new entry");
            slots.add(id, bytes);
        }
        let ids = |slots: &CacheSlots<()>| slots.slots.keys().cloned().collect::<Vec<_>>();
        assert_eq!(ids(&slots), ["b", "c"]);
        slots.add("c", MAX_BYTES + 1);
        assert!(slots.slots.is_empty() && slots.stored.is_empty());
    }

    #[test]
    fn cached_images_need_at_most_64_mib() {
        let mut slots = CacheSlots::<()>::new(MAX_BYTES);
        for number in 0..1000 {
            let id = number.to_string();
            slots.entry(&id).set(Arc::new(())).expect("a new entry");
            slots.add(&id, 1 << 20);
            assert!(slots.slots.len() <= 64, "{} MiB", slots.slots.len());
        }
        assert!(!slots.slots.is_empty());
    }

    #[test]
    fn an_entry_without_value_is_removed_unless_another_request_waits_for_it() {
        let mut slots = CacheSlots::<()>::new(MAX_BYTES);
        let (first, second) = (slots.entry("a"), slots.entry("a"));
        slots.remove_failed("a", first);
        assert_eq!(slots.slots.len(), 1);
        slots.remove_failed("a", second);
        assert!(slots.slots.is_empty());
    }
}
