//! Stores the failure of a stage of a pair, and reports it.

use super::error::RunError;
use super::events::RunEvent;
use super::policy::{self, FailedAttempt};
use super::run_context::{PairEnd, RunContext};
use mocban_catalog::{FailureAction, InputVersions, Lease, PairProvenance, StageFailure};
use mocban_core::domain::{Failure, PairName, Stage};

/// A stage of a pair that failed.
pub(super) struct PairFailure {
    pub(super) name: PairName,
    /// The manifest attributes as JSON.
    pub(super) attributes: String,
    pub(super) stage: Stage,
    pub(super) failure: Failure,
    /// Whether a retry may succeed.
    pub(super) is_transient: bool,
    /// The input files as read.
    pub(super) inputs: InputVersions,
    pub(super) ms: Option<u64>,
}

impl PairFailure {
    /// Stores the failure under the lease. Returns how the pair ended.
    pub(super) async fn store(
        self,
        context: &RunContext,
        lease: Lease,
    ) -> Result<PairEnd, RunError> {
        let Self { stage, failure, .. } = self;
        let now = context.clock.now();
        let attempt = FailedAttempt {
            id: lease.id(),
            class: failure.class,
            is_transient: self.is_transient,
            attempt: lease.attempt(),
            ran_alone: lease.exclusive(),
        };
        let action = policy::failure_action(attempt, now);
        let record = StageFailure {
            stage,
            failure: failure.clone(),
            action,
            provenance: PairProvenance::new(
                context.fingerprints.of(stage),
                &self.inputs,
                self.attributes,
            ),
            inputs: self.inputs,
            ms: self.ms,
            at: now,
            alive_since: context.alive_since(),
        };
        if !context.catalog.fail(lease, record).await? {
            tracing::info!(pair = %self.name, "the lease is lost, so its failure is not stored");
            return Ok(PairEnd::LeaseLost);
        }
        let pair = self.name;
        if action == FailureAction::Quarantine {
            let skipped = (context.until.index() + 1).saturating_sub(stage.index()) as u64;
            context.emit(RunEvent::PairFailed {
                pair,
                stage,
                failure,
                skipped,
            });
            return Ok(PairEnd::Failed);
        }
        context.emit(RunEvent::PairBackingOff {
            pair,
            stage,
            failure,
            wait_ms: action.wait_ms(now),
        });
        Ok(PairEnd::Retry)
    }
}
