//! The small pictures that were drawn last, so that a gallery that is shown again needs no file.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Mutex;

use axum::body::Bytes;

use mocban_core::locked;

/// Most bytes that are kept.
const MAX_BYTES: usize = 32 << 20;

/// Pictures by what they show. The oldest are dropped first.
#[derive(Debug, Default)]
pub(super) struct ThumbCache(Mutex<CachedThumbs>);

#[derive(Debug, Default)]
struct CachedThumbs {
    by_key: BTreeMap<String, Bytes>,
    order: VecDeque<String>,
    bytes: usize,
}

impl ThumbCache {
    /// Returns a picture that was kept.
    pub(super) fn get(&self, key: &str) -> Option<Bytes> {
        let cached = locked(&self.0);
        cached.by_key.get(key).cloned()
    }

    /// Keeps a picture.
    pub(super) fn add(&self, key: String, picture: Bytes) {
        let mut cached = locked(&self.0);
        cached.bytes += picture.len();
        if let Some(earlier) = cached.by_key.insert(key.clone(), picture) {
            cached.bytes -= earlier.len();
            return;
        }
        cached.order.push_back(key);
        while cached.bytes > MAX_BYTES
            && let Some(oldest) = cached.order.pop_front()
        {
            let dropped = cached.by_key.remove(&oldest);
            cached.bytes -= dropped.map_or(0, |picture| picture.len());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{MAX_BYTES, ThumbCache};

    #[test]
    fn the_oldest_pictures_are_dropped() {
        let cache = ThumbCache::default();
        let picture = || vec![0; MAX_BYTES / 3].into();
        for key in ["a", "b", "c", "b"] {
            cache.add(key.to_owned(), picture());
        }
        assert!(cache.get("a").is_some());
        cache.add("d".to_owned(), picture());
        assert!(cache.get("a").is_none());
        assert!(["b", "c", "d"].iter().all(|key| cache.get(key).is_some()));
    }
}
