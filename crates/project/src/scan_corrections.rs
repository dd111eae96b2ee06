//! Corrects what is known of the scans of pairs: their unit, or which of their sides is carved.

use crate::error::ProjectResult;
use crate::location::{Location, now};
use mocban_catalog::ScanCorrection;
use mocban_core::domain::PairName;

/// Corrects the scans of pairs as an import of a list does, so that the next run computes them again. Returns the number of
/// pairs that changed: retired pairs and pairs that were cut from blocks do not.
pub async fn correct_scans(
    names: Vec<PairName>,
    correction: ScanCorrection,
    location: &Location,
) -> ProjectResult<u64> {
    let (_project, catalog) = location.open().await?;
    let changed = catalog.correct_scans(names, correction, now()).await?;
    catalog.close().await;
    Ok(changed)
}
