//! Values behind a lock.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Locks a value, even if a thread has panicked while it held the lock: each change must leave the value whole.
pub fn locked<T>(value: &Mutex<T>) -> MutexGuard<'_, T> {
    value.lock().unwrap_or_else(PoisonError::into_inner)
}
