//! One pair's way: the stages that are left, a checkpoint after each.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::mpsc;

use super::RunError;
use super::breakpoint::{self, Point};
use super::clock::Clock;
use super::events::RunEvent;
use super::execute::{Computed, Ended, Filed, compute};
use super::hand::PairInHand;
use super::policy::{self, Try};
use super::steps::{Setback, Steps};
use super::stop::{Stop, StopLevel};
use crate::catalog::{
    Catalog, InputsSeen, Kept, Lease, RecipeIds, Sentence, StageDone, StageFailed,
};
use crate::domain::{Failure, FailureClass, PairName, Stage, UnixMillis};
use crate::store::Project;

/// What the pairs of a run have in common.
pub(super) struct Shared {
    pub(super) catalog: Catalog,
    pub(super) project: Project,
    pub(super) steps: Arc<dyn Steps>,
    pub(super) recipes: RecipeIds,
    pub(super) clock: Clock,
    pub(super) stop: Stop,
    /// Raised when the run drains for a reason of its own.
    pub(super) drain: Stop,
    pub(super) until: Stage,
    pub(super) stage_limit: Duration,
    pub(super) events: mpsc::UnboundedSender<RunEvent>,
}

/// How a pair left its worker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PairEnd {
    /// Done as far as the run goes.
    Done,
    /// Quarantined.
    Failed,
    /// To be tried again.
    Later,
    /// Given back unfinished.
    GivenBack,
    /// Somebody else has it now.
    Lost,
}

/// What a worker has to say at the end of a pair.
#[derive(Debug)]
pub(super) struct PairReport {
    pub(super) end: PairEnd,
    /// Stages that were computed and stored.
    pub(super) stages: u64,
    /// Why the run cannot go on, if it cannot.
    pub(super) fatal: Option<RunError>,
}

/// What is stored with a failure even when the pair in hand is gone.
struct Known {
    name: PairName,
    facts: String,
    inputs: InputsSeen,
}

impl Shared {
    /// Whether nothing new is to be begun.
    pub(super) fn is_draining(&self) -> bool {
        self.stop.level().max(self.drain.level()) >= StopLevel::Drain
    }

    pub(super) fn deadline(&self) -> UnixMillis {
        self.clock.now() + self.stage_limit.as_millis() as i64
    }

    pub(super) fn tell(&self, event: RunEvent) {
        // The run may have ended by an error; then nobody listens any more.
        let _ = self.events.send(event);
    }
}

/// Takes a leased pair through the stages that are left.
pub(super) async fn work(shared: Arc<Shared>, lease: Lease) -> PairReport {
    let mut stages = 0;
    match through(&shared, lease, &mut stages).await {
        Ok(end) => PairReport {
            end,
            stages,
            fatal: None,
        },
        Err(error) => PairReport {
            end: PairEnd::GivenBack,
            stages,
            fatal: Some(error),
        },
    }
}

async fn through(shared: &Shared, lease: Lease, stages: &mut u64) -> Result<PairEnd, RunError> {
    let mut stage = lease.cursor();
    let mut pair = Box::new(PairInHand::new(shared.catalog.work(&lease).await?));
    let mut lease = lease;
    breakpoint::reach(stage, Point::Claimed);
    loop {
        let name = pair.facts.name.clone();
        let known = Known {
            name: name.clone(),
            facts: pair.facts_text.clone(),
            inputs: pair.inputs.clone(),
        };
        shared.tell(RunEvent::StageStarted { pair: name, stage });
        let computed = compute(
            &shared.steps,
            &shared.project,
            stage,
            pair,
            shared.stage_limit,
            &shared.stop,
        );
        let (back, filed, ms) = match computed.await {
            Computed::Ended(back, Ended::Filed(filed), ms) => (back, filed, ms),
            Computed::Ended(back, Ended::Setback(Setback::Back(earlier)), _) => {
                (pair, stage) = (back, earlier);
                continue;
            }
            Computed::Ended(_, Ended::NotFiled(error), _) => {
                shared.catalog.release(lease).await?;
                return Err(error.into());
            }
            Computed::Stopped => {
                shared.catalog.release(lease).await?;
                return Ok(PairEnd::GivenBack);
            }
            other => return fail(shared, lease, stage, known, other).await,
        };
        pair = back;
        let done = done(shared, &pair, stage, filed, ms);
        let kept = shared.catalog.checkpoint(lease, done).await?;
        lease = match kept {
            Kept::Lost => return Ok(PairEnd::Lost),
            Kept::Done => {
                *stages += 1;
                finished(shared, known.name, stage, ms);
                return Ok(PairEnd::Done);
            }
            Kept::Lease(lease) => lease,
        };
        *stages += 1;
        finished(shared, known.name, stage, ms);
        if let Some(end) = rest(shared, stage) {
            shared.catalog.release(lease).await?;
            return Ok(end);
        }
        stage = lease.cursor();
    }
}

/// Whether the pair is put down here although stages are left.
fn rest(shared: &Shared, done: Stage) -> Option<PairEnd> {
    if done >= shared.until {
        Some(PairEnd::Done)
    } else if shared.is_draining() {
        Some(PairEnd::GivenBack)
    } else {
        None
    }
}

fn finished(shared: &Shared, pair: PairName, stage: Stage, ms: u64) {
    breakpoint::reach(stage, Point::Stored);
    let last = stage == shared.until.min(Stage::Register);
    shared.tell(RunEvent::StageFinished {
        pair: pair.clone(),
        stage,
        ms,
    });
    if last {
        shared.tell(RunEvent::PairDone { pair });
    }
}

fn done(shared: &Shared, pair: &PairInHand, stage: Stage, filed: Filed, ms: u64) -> StageDone {
    let stored = &pair.stored[&stage];
    StageDone {
        stage,
        recipe: shared.recipes.of(stage),
        mesh_hash: stored.mesh_hash,
        print_hash: stored.print_hash,
        facts: pair.facts_text.clone(),
        outcome: filed.outcome,
        files: filed.files,
        result_hash: filed.result_hash,
        metrics: filed.metrics,
        inputs: pair.inputs.clone(),
        ms,
        at: shared.clock.now(),
        next_deadline: shared.deadline(),
    }
}

/// Stores a failure and tells of it.
async fn fail(
    shared: &Shared,
    lease: Lease,
    stage: Stage,
    known: Known,
    computed: Computed,
) -> Result<PairEnd, RunError> {
    let (failure, may_pass, inputs, ms) = blame(shared, known.inputs, computed);
    let now = shared.clock.now();
    let sentence = policy::sentence(
        Try {
            pair: lease.pair(),
            class: failure.class,
            may_pass,
            attempt: lease.attempt(),
            alone: lease.alone(),
        },
        now,
    );
    let failed = StageFailed {
        stage,
        failure: failure.clone(),
        sentence,
        recipe: shared.recipes.of(stage),
        facts: known.facts,
        inputs,
        ms,
        at: now,
    };
    if !shared.catalog.fail(lease, failed).await? {
        return Ok(PairEnd::Lost);
    }
    let pair = known.name;
    let (event, end) = match sentence {
        Sentence::Quarantine => {
            let skipped = (shared.until.index() + 1).saturating_sub(stage.index()) as u64;
            let event = RunEvent::PairFailed {
                pair,
                stage,
                failure,
                skipped,
            };
            (event, PairEnd::Failed)
        }
        Sentence::BackOff { .. } | Sentence::Alone => {
            let wait_ms = match sentence {
                Sentence::BackOff { run_at } => (run_at - now).unsigned_abs(),
                Sentence::Alone | Sentence::Quarantine => 0,
            };
            let event = RunEvent::PairBackingOff {
                pair,
                stage,
                failure,
                wait_ms,
            };
            (event, PairEnd::Later)
        }
    };
    shared.tell(event);
    Ok(end)
}

/// What went wrong, whether it may pass, what was read, and the time it took.
fn blame(
    shared: &Shared,
    before: InputsSeen,
    computed: Computed,
) -> (Failure, bool, InputsSeen, Option<u64>) {
    let bug = |text: String| Failure::new(FailureClass::Bug, text);
    match computed {
        Computed::Ended(pair, Ended::Setback(Setback::Failed { failure, may_pass }), ms) => {
            (failure, may_pass, pair.inputs, Some(ms))
        }
        Computed::Panicked(text) => (bug(text), false, before, None),
        Computed::TimedOut => {
            let limit = shared.stage_limit.as_secs_f64();
            let text = format!("the stage took longer than {limit} s (run.stage_limit_s)");
            let failure = Failure::new(FailureClass::Resource, text);
            (failure, false, before, None)
        }
        // The caller has dealt with these.
        Computed::Ended(
            pair,
            Ended::Filed(_) | Ended::NotFiled(_) | Ended::Setback(Setback::Back(_)),
            ms,
        ) => (
            bug("the stage ended in no known way".to_owned()),
            false,
            pair.inputs,
            Some(ms),
        ),
        Computed::Stopped => (bug("stopped".to_owned()), false, before, None),
    }
}
