//! One pair's way: the stages that are left, a checkpoint after each.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::mpsc;

use super::RunError;
use super::clock::Clock;
use super::events::RunEvent;
use super::execute::{Computed, Ended, Filed, compute};
use super::hand::PairInHand;
use super::policy::{self, Try};
use super::refresh;
use super::steps::{Setback, Steps};
use super::stop::{Stop, StopLevel};
use super::timing::Timing;
use crate::breakpoint::{self, Point};
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
    pub(super) timing: Timing,
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
    mesh_path: String,
    print_path: String,
    inputs: InputsSeen,
}

/// How one stage of a pair went.
enum Step {
    /// Computed and on disk.
    Done(Box<PairInHand>, Box<StageDone>),
    /// An earlier stage must run again first.
    Back(Box<PairInHand>, Stage),
    /// Failed.
    Failed(Blame),
    /// The run is to stop now.
    Stopped,
    /// The disk refused.
    Refused(RunError),
}

/// What went wrong.
struct Blame {
    failure: Failure,
    /// Whether another try may go better.
    may_pass: bool,
    /// Input files as read, where the pair came back.
    inputs: Option<InputsSeen>,
    ms: Option<u64>,
}

impl Shared {
    /// Whether nothing new is to be begun.
    pub(super) fn is_draining(&self) -> bool {
        self.stop.level().max(self.drain.level()) >= StopLevel::Drain
    }

    pub(super) fn deadline(&self) -> UnixMillis {
        self.clock.now() + self.stage_limit.as_millis() as i64
    }

    /// How far back this process's last sign of life may lie for its leases to stand.
    pub(super) fn alive_since(&self) -> UnixMillis {
        self.clock.now() - self.timing.lease_ms()
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
    breakpoint::reach(stage, Point::Claimed, Some(&pair.facts.name));
    loop {
        let known = Known::of(&pair);
        let (back, done) = match step(shared, stage, pair).await {
            Step::Done(back, done) => (back, done),
            Step::Back(back, earlier) => {
                (pair, stage) = (back, earlier);
                continue;
            }
            Step::Failed(blame) => return fail(shared, lease, stage, known, blame).await,
            Step::Stopped => {
                shared.catalog.release(lease).await?;
                return Ok(PairEnd::GivenBack);
            }
            Step::Refused(error) => {
                shared.catalog.release(lease).await?;
                return Err(error);
            }
        };
        let ms = done.ms;
        let kept = shared.catalog.checkpoint(lease, *done).await?;
        if !matches!(kept, Kept::Lost) {
            *stages += 1;
            finished(shared, known.name, stage, ms);
        }
        lease = match kept {
            Kept::Lost => return Ok(PairEnd::Lost),
            Kept::Done => return Ok(PairEnd::Done),
            Kept::Lease(lease) => lease,
        };
        if let Some(end) = rest(shared, stage) {
            shared.catalog.release(lease).await?;
            return Ok(end);
        }
        (pair, stage) = (back, lease.cursor());
    }
}

/// Runs one stage.
async fn step(shared: &Shared, stage: Stage, pair: Box<PairInHand>) -> Step {
    shared.tell(RunEvent::StageStarted {
        pair: pair.facts.name.clone(),
        stage,
    });
    let (steps, project) = (&shared.steps, &shared.project);
    let limit = shared.stage_limit;
    match compute(steps, project, stage, pair, limit, &shared.stop).await {
        Computed::Ended(pair, Ended::Filed(filed), ms) => {
            let done = done(shared, &pair, stage, filed, ms);
            Step::Done(pair, Box::new(done))
        }
        Computed::Ended(pair, Ended::Setback(Setback::Back(earlier)), _) => {
            Step::Back(pair, earlier)
        }
        Computed::Ended(pair, Ended::Setback(Setback::Failed { failure, may_pass }), ms) => {
            Step::Failed(Blame {
                failure,
                may_pass,
                inputs: Some(pair.inputs),
                ms: Some(ms),
            })
        }
        Computed::Ended(_, Ended::NotFiled(error), _) => Step::Refused(error.into()),
        Computed::NoThread(error) => {
            let text = format!("the system gave no thread for {stage}: {error}");
            Step::Failed(Blame::bare(FailureClass::Resource, text))
        }
        Computed::Panicked(text) => Step::Failed(Blame::bare(FailureClass::Bug, text)),
        Computed::TimedOut => {
            let text = format!("{stage} took longer than {} s", limit.as_secs_f64());
            Step::Failed(Blame::bare(FailureClass::Resource, text))
        }
        Computed::Stopped => Step::Stopped,
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
    breakpoint::reach(stage, Point::Stored, Some(&pair));
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
        alive_since: shared.alive_since(),
    }
}

/// Stores a failure and tells of it.
async fn fail(
    shared: &Shared,
    lease: Lease,
    stage: Stage,
    known: Known,
    blame: Blame,
) -> Result<PairEnd, RunError> {
    let inputs = match blame.inputs {
        Some(inputs) => inputs,
        None => known.inputs(&shared.project).await,
    };
    let now = shared.clock.now();
    let failed = Try {
        pair: lease.pair(),
        class: blame.failure.class,
        may_pass: blame.may_pass,
        attempt: lease.attempt(),
        alone: lease.alone(),
    };
    let sentence = policy::sentence(failed, now);
    let failed = StageFailed {
        stage,
        failure: blame.failure.clone(),
        sentence,
        recipe: shared.recipes.of(stage),
        facts: known.facts,
        inputs,
        ms: blame.ms,
        at: now,
        alive_since: shared.alive_since(),
    };
    if !shared.catalog.fail(lease, failed).await? {
        return Ok(PairEnd::Lost);
    }
    let (event, end) = told(shared, stage, sentence, known.name, blame.failure, now);
    shared.tell(event);
    Ok(end)
}

/// What is told of a failure, and how the pair leaves its worker.
fn told(
    shared: &Shared,
    stage: Stage,
    sentence: Sentence,
    pair: PairName,
    failure: Failure,
    now: UnixMillis,
) -> (RunEvent, PairEnd) {
    let wait_ms = match sentence {
        Sentence::BackOff { run_at } => (run_at - now).unsigned_abs(),
        Sentence::Alone => 0,
        Sentence::Quarantine => {
            let skipped = (shared.until.index() + 1).saturating_sub(stage.index()) as u64;
            let event = RunEvent::PairFailed {
                pair,
                stage,
                failure,
                skipped,
            };
            return (event, PairEnd::Failed);
        }
    };
    let event = RunEvent::PairBackingOff {
        pair,
        stage,
        failure,
        wait_ms,
    };
    (event, PairEnd::Later)
}

impl Known {
    fn of(pair: &PairInHand) -> Self {
        Self {
            name: pair.facts.name.clone(),
            facts: pair.facts_text.clone(),
            mesh_path: pair.facts.mesh_path.clone(),
            print_path: pair.facts.print_path.clone(),
            inputs: pair.inputs.clone(),
        }
    }

    /// The input files as they were read, or as they are now where the reader was lost: a file that is mended later
    /// must be told from the one that failed.
    async fn inputs(&self, project: &Project) -> InputsSeen {
        let seen = self.inputs.clone();
        let paths = [&self.mesh_path, &self.print_path].map(|path| project.input_path(path));
        let look = move || InputsSeen {
            mesh: seen.mesh.or_else(|| refresh::seen_now(&paths[0])),
            print: seen.print.or_else(|| refresh::seen_now(&paths[1])),
        };
        match tokio::task::spawn_blocking(look).await {
            Ok(inputs) => inputs,
            Err(panic) => std::panic::resume_unwind(panic.into_panic()),
        }
    }
}

impl Blame {
    /// A failure after which nothing is left of the pair in hand.
    fn bare(class: FailureClass, text: String) -> Self {
        Self {
            failure: Failure::new(class, text),
            may_pass: false,
            inputs: None,
            ms: None,
        }
    }
}
