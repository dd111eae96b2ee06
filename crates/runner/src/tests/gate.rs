//! A gate at which fake stages wait until a test opens it.

use std::sync::{Condvar, Mutex};

/// A gate that is closed at first.
#[derive(Debug, Default)]
pub(super) struct Gate {
    is_open: Mutex<bool>,
    opened: Condvar,
}

impl Gate {
    /// Opens the gate for good.
    pub(super) fn open(&self) {
        *self.is_open.lock().expect("an unpoisoned lock") = true;
        self.opened.notify_all();
    }

    /// Waits until the gate is open.
    pub(super) fn wait(&self) {
        let is_open = self.is_open.lock().expect("an unpoisoned lock");
        let is_open = self.opened.wait_while(is_open, |is_open| !*is_open);
        drop(is_open.expect("an unpoisoned lock"));
    }
}
