//! A few values that are likely to be needed again: artifacts of a pair are in one pack and are read one after another.

use std::collections::VecDeque;
use std::sync::Mutex;

use super::bucket_error::BucketError;
use mocban_core::locked;

/// Number of values that are kept.
const MAX_VALUES: usize = 16;

/// The values of the names used last, newest first.
#[derive(Debug)]
pub(super) struct SmallCache<T>(Mutex<VecDeque<(String, T)>>);

impl<T> Default for SmallCache<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T: Clone> SmallCache<T> {
    /// Returns the value of a name, or computes it. Threads that need the same value may compute it twice.
    pub(super) fn get_or_insert(
        &self,
        name: &str,
        compute: impl FnOnce() -> Result<T, BucketError>,
    ) -> Result<T, BucketError> {
        if let Some((_, value)) = locked(&self.0).iter().find(|(known, _)| known == name) {
            return Ok(value.clone());
        }
        let value = compute()?;
        let mut recent = locked(&self.0);
        recent.push_front((name.to_owned(), value.clone()));
        recent.truncate(MAX_VALUES);
        Ok(value)
    }

    /// Removes all values.
    #[cfg(test)]
    pub(super) fn clear(&self) {
        self.0.lock().expect("no panic").clear();
    }
}
