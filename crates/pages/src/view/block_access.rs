//! The access of pages to a block of the project, whose catalog is open only while it is used, so that a page that stays open
//! does not hold it.

use std::sync::Arc;

use crate::local_server::WorkThread;
use mocban_core::domain::BlockName;
use mocban_project::location::Location;

/// A block of the project, its control points and its labels.
#[derive(Debug, Clone)]
pub struct BlockAccess {
    pub(super) location: Location,
    pub(super) block: BlockName,
    next_command: Option<String>,
    work: Arc<WorkThread>,
}

impl BlockAccess {
    /// Creates the access to a block. `next_command` aligns it again, and `work` draws its pictures. A thread for each block
    /// would keep memory of its own after the block is closed.
    pub fn new(
        location: &Location,
        block: &BlockName,
        next_command: Option<String>,
        work: Arc<WorkThread>,
    ) -> Self {
        Self {
            location: location.clone(),
            block: block.clone(),
            next_command,
            work,
        }
    }

    /// Returns the command that aligns the block again; `None` if a page has a button for it.
    pub(super) fn next_command(&self) -> Option<String> {
        self.next_command.clone()
    }

    /// Returns the thread that draws the pictures of the block.
    pub(super) fn work(&self) -> Arc<WorkThread> {
        Arc::clone(&self.work)
    }

    /// Returns the relative address of the page of the block. Only the app has one, and it has no command.
    pub(super) fn back(&self) -> Option<&'static str> {
        self.next_command.is_none().then_some("../")
    }
}
