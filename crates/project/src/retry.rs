//! Lets failed pairs and blocks run again.

use crate::error::ProjectResult;
use crate::exit::Refusal;
use crate::location::Location;
use crate::selection;
use mocban_catalog::RetrySelection;
use mocban_core::domain::FailureClass;
use mocban_runner::NamedWork;

/// Which failed pairs and blocks to retry.
#[derive(Debug, Clone)]
pub enum RetryRequest {
    /// All.
    All,
    /// Those that failed with a class.
    Class(FailureClass),
    /// Those with these ids.
    Names(Vec<String>),
}

/// Numbers of pairs and blocks that will run again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Retried {
    /// Pairs.
    pub pairs: u64,
    /// Blocks.
    pub blocks: u64,
}

/// Lets failed pairs and blocks run again.
///
/// # Errors
/// Returns an error if an id does not exist, nothing of the request has failed, or the catalog fails.
pub async fn retry(request: &RetryRequest, location: &Location) -> ProjectResult<Retried> {
    let (_project, catalog) = location.open().await?;
    let (pairs, blocks) = match request {
        RetryRequest::All => (RetrySelection::All, RetrySelection::All),
        RetryRequest::Class(class) => {
            (RetrySelection::Class(*class), RetrySelection::Class(*class))
        }
        RetryRequest::Names(names) => {
            let NamedWork { pairs, blocks } = selection::pairs_and_blocks(&catalog, names).await?;
            (RetrySelection::Names(pairs), RetrySelection::Names(blocks))
        }
    };
    let [pairs, blocks] = catalog.retry_pairs_and_blocks(&pairs, &blocks).await?;
    catalog.close().await;
    if pairs + blocks > 0 {
        return Ok(Retried { pairs, blocks });
    }
    let text = match request {
        RetryRequest::All => "no pair or block has failed".to_owned(),
        RetryRequest::Class(class) => format!("no pair or block has failed with class {class}"),
        RetryRequest::Names(_) => "none of these has failed".to_owned(),
    };
    Err(Refusal::NothingSelected(text).into())
}
