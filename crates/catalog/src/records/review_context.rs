//! Context in which a verdict was given.

use serde::{Deserialize, Serialize};

use crate::db::row::from_row;
use mocban_core::domain::{ContentHash, ReviewOrder};

/// Context of a verdict. All fields are `None` if the context is unknown.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ReviewContext {
    /// Idempotency key of the client. A verdict that is sent twice is stored once.
    pub event: Option<String>,
    /// Hash of everything that the shown image was made from.
    pub seen: Option<ContentHash>,
    /// How long the image was shown, in milliseconds.
    pub shown_ms: Option<u64>,
    /// Reviewer's estimate of how far the relief must still be rotated to match the print, in degrees clockwise.
    pub angle_read_deg: Option<f64>,
    /// Order of the review queue.
    pub review_order: Option<ReviewOrder>,
}

from_row! { ReviewContext { event, seen, shown_ms, angle_read_deg, review_order } }
