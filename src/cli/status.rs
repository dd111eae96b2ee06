//! `status`: where the project stands, on one screen.

use std::io::IsTerminal;
use std::time::Duration;

use clap::Args;
use serde_json::Value;

use super::context::{Context, quoted};
use super::exit::ExitCode;
use super::failures::Failures;
use super::output::{self, Palette, Tone};
use super::progress::CLEAR;
use super::table::{Align, columns, count};
use super::verdict::reviewer_name;
use crate::catalog::{Catalog, Recipes, StageCounts, StatusCounts};
use crate::domain::{JobStatus, MetricOutcome, Stage, Verdict};
use crate::runner;
use crate::store::{Project, RunLock};

/// Arguments of `status`.
#[derive(Debug, Args)]
pub(super) struct StatusArgs {
    /// Look again every two seconds until Ctrl-C
    #[arg(short, long)]
    pub(super) watch: bool,
    /// Name every failed pair with its reason, not only the first of each class
    #[arg(long)]
    pub(super) failed: bool,
}

const EVERY: Duration = Duration::from_secs(2);

pub(super) async fn status(args: StatusArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let (project, catalog) = context.reader().await?;
    loop {
        let recipes = runner::recipes(&context.settings()?.config.stages);
        let failures = if args.failed {
            Failures::read_all(&catalog).await?
        } else {
            Failures::read(&catalog).await?
        };
        let view = View::read(&project, &catalog, &recipes, failures).await?;
        show(&view, &args, context)?;
        if !args.watch {
            break;
        }
        tokio::select! {
            () = tokio::time::sleep(EVERY) => {}
            _ = tokio::signal::ctrl_c() => break,
        }
    }
    catalog.close().await;
    Ok(ExitCode::Done)
}

/// What the screen shows.
struct View {
    counts: StatusCounts,
    /// Whether a process works on the project: without one nothing runs, whatever the leases say.
    running: bool,
    failures: Failures,
}

impl View {
    async fn read(
        project: &Project,
        catalog: &Catalog,
        recipes: &Recipes,
        failures: Failures,
    ) -> anyhow::Result<Self> {
        // Before the counts: a run that ends in between leaves no leases.
        let running = RunLock::is_held(project);
        let counts = catalog.status(recipes).await?;
        Ok(Self {
            counts,
            running,
            failures,
        })
    }

    fn jobs(&self, status: JobStatus) -> u64 {
        self.counts.jobs.get(&status).copied().unwrap_or(0)
    }

    fn waiting(&self) -> u64 {
        self.jobs(JobStatus::Ready) + self.jobs(JobStatus::Backoff)
    }

    /// Pairs that a process had in hand when it died; the next run takes them up.
    fn interrupted(&self) -> u64 {
        if self.running {
            0
        } else {
            self.jobs(JobStatus::Leased)
        }
    }

    fn json(&self, names_failed: bool) -> anyhow::Result<Value> {
        let mut json = serde_json::to_value(&self.counts)?;
        json["running"] = Value::from(self.running);
        if names_failed {
            json["failures"] = self.failures.json();
        }
        Ok(json)
    }

    fn failed(&self) -> u64 {
        self.jobs(JobStatus::Quarantined)
    }
}

fn show(view: &View, args: &StatusArgs, context: &Context) -> anyhow::Result<()> {
    let output = &context.output;
    if context.global.json {
        let json = view.json(args.failed)?;
        if args.watch {
            output::print(&json.to_string())?;
        } else {
            output::print_json(&json)?;
        }
    } else {
        let clear = if args.watch && std::io::stdout().is_terminal() {
            CLEAR
        } else {
            ""
        };
        let dir = context.dir().display().to_string();
        output::print(&format!("{clear}{}", screen(view, &dir, output.out)))?;
        for command in next_steps(view) {
            output.next(&context.command(&command));
        }
    }
    Ok(())
}

fn screen(view: &View, dir: &str, palette: Palette) -> String {
    let line = |word: &str, text: &str| format!("{}  {text}\n", label(word, palette));
    let mut parts = vec![
        line("project", &headline(view, dir, palette)),
        stage_table(&view.counts, palette),
    ];
    if view.failed() > 0 {
        parts.push(format!("{}\n", label("failed", palette)));
        parts.push(view.failures.text());
    }
    if view.interrupted() > 0 {
        let text = "the process that had them died; the next run takes them up";
        parts.push(line("cut off", text));
    }
    if view.counts.stale > 0 {
        let pairs = count(view.counts.stale, "pair");
        let text = format!("{pairs} ran with other settings or files than those of now");
        parts.push(line("stale", &text));
    }
    parts.extend(doubtful_line(&view.counts).map(|text| line("doubtful", &text)));
    parts.extend(verdict_line(&view.counts).map(|text| line("verdicts", &text)));
    parts.concat()
}

fn label(word: &str, palette: Palette) -> String {
    palette.paint(Tone::Strong, format!("{word:<9}"))
}

/// `demo · 24 pairs · 22 done · 1 failed · 1 waiting · 91.7 %`
fn headline(view: &View, dir: &str, palette: Palette) -> String {
    let done = view.jobs(JobStatus::Done);
    let pairs = view.counts.pairs;
    let mut parts = vec![
        dir.to_owned(),
        count(pairs, "pair"),
        palette.paint(Tone::Good, format!("{done} done")),
    ];
    for (number, word, tone) in [
        (view.failed(), "failed", Tone::Bad),
        (
            view.jobs(JobStatus::Leased) - view.interrupted(),
            "running",
            Tone::Strong,
        ),
        (view.interrupted(), "cut off", Tone::Warn),
        (view.waiting(), "waiting", Tone::Warn),
        (view.jobs(JobStatus::Held), "set aside", Tone::Warn),
    ] {
        if number > 0 {
            parts.push(palette.paint(tone, format!("{number} {word}")));
        }
    }
    if pairs > 0 {
        parts.push(format!("{:.1} %", done as f64 * 100.0 / pairs as f64));
    }
    parts.join(" · ")
}

fn stage_table(counts: &StatusCounts, palette: Palette) -> String {
    let of = |stage: Stage| counts.stages.get(&stage).copied().unwrap_or_default();
    let head = Stage::ALL.map(|stage| palette.paint(Tone::Strong, stage));
    let row = |name: &str, cell: &dyn Fn(StageCounts) -> String| {
        let cells = Stage::ALL.map(|stage| cell(of(stage)));
        [vec![label(name, palette)], cells.to_vec()].concat()
    };
    let rows = [
        [vec![label("stages", palette)], head.to_vec()].concat(),
        row("  done", &|stage| stage.done.to_string()),
        row("  pending", &|stage| stage.pending.to_string()),
        row("  failed", &|stage| {
            let tone = if stage.failed == 0 {
                Tone::Faint
            } else {
                Tone::Bad
            };
            palette.paint(tone, stage.failed)
        }),
    ];
    columns(
        &rows,
        &[
            Align::Left,
            Align::Right,
            Align::Right,
            Align::Right,
            Align::Right,
        ],
    )
}

fn doubtful_line(counts: &StatusCounts) -> Option<String> {
    (counts.doubtful > 0).then(|| {
        let pairs = count(counts.doubtful, "done pair");
        format!(
            "{pairs} with a confidence below {}",
            MetricOutcome::DOUBTFUL
        )
    })
}

fn verdict_line(counts: &StatusCounts) -> Option<String> {
    let of = |verdict: Verdict| counts.verdicts.get(&verdict).copied().unwrap_or(0);
    let total: u64 = Verdict::ALL.into_iter().map(of).sum();
    (total > 0).then(|| {
        Verdict::ALL
            .map(|verdict| format!("{} {verdict}", of(verdict)))
            .join(" · ")
    })
}

fn next_steps(view: &View) -> Vec<String> {
    let mut steps = Vec::new();
    if view.counts.pairs == 0 {
        steps.push("import pairs.csv".to_owned());
    }
    let running = view.jobs(JobStatus::Leased) > view.interrupted();
    if !running && view.waiting() + view.interrupted() + view.counts.stale > 0 {
        steps.push("run".to_owned());
    }
    if let Some(first) = view.failures.first() {
        steps.push(format!("show {}", first.name));
    }
    if view.counts.doubtful > 0 {
        steps.push("contact-sheet --order confidence".to_owned());
    }
    if view.jobs(JobStatus::Done) > 0 && !running {
        if view.counts.verdicts.values().sum::<u64>() == 0 {
            let user = std::env::var("USER").ok();
            steps.push(review_step(user.as_deref()));
        }
        steps.push("report".to_owned());
    }
    steps
}

/// How to judge what nobody has read, under the name of who asks.
fn review_step(user: Option<&str>) -> String {
    let name = user.and_then(|user| reviewer_name(user).ok());
    let name = name.unwrap_or_else(|| "me".to_owned());
    format!("review --reviewer {}", quoted(&name))
}

#[cfg(test)]
mod tests {
    use super::{
        JobStatus, Palette, Stage, StageCounts, StatusCounts, Verdict, View, next_steps,
        review_step, screen,
    };

    fn view(done: u64, ready: u64) -> View {
        let stage = StageCounts {
            done,
            pending: ready,
            failed: 0,
        };
        View {
            counts: StatusCounts {
                schema: 1,
                pairs: done + ready,
                jobs: [(JobStatus::Done, done), (JobStatus::Ready, ready)].into(),
                stages: Stage::ALL.map(|name| (name, stage)).into(),
                stale: 0,
                doubtful: 0,
                verdicts: std::collections::BTreeMap::new(),
            },
            running: true,
            failures: super::Failures::default(),
        }
    }

    #[test]
    fn what_a_dead_process_had_in_hand_is_not_running() {
        let mut view = view(3, 0);
        view.counts.jobs.insert(JobStatus::Leased, 2);
        let headline = |view: &View| {
            let text = screen(view, "demo", Palette::PLAIN);
            text.lines().next().map(str::to_owned)
        };
        let told = |word: &str| {
            Some(format!(
                "project    demo · 3 pairs · 3 done · 2 {word} · 100.0 %"
            ))
        };
        assert_eq!(headline(&view), told("running"));
        assert!(next_steps(&view).is_empty());
        view.running = false;
        assert_eq!(headline(&view), told("cut off"));
        let steps = next_steps(&view);
        assert_eq!([&steps[0], &steps[steps.len() - 1]], ["run", "report"]);
        assert_eq!(view.json(false).expect("JSON")["running"], false);
    }

    #[test]
    fn screen_has_a_headline_and_a_row_for_each_count() {
        let text = screen(&view(3, 1), "demo", Palette::PLAIN);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines[0],
            "project    demo · 4 pairs · 3 done · 1 waiting · 75.0 %"
        );
        assert_eq!(lines[1], "stages     fit  depth  normalize  register");
        assert_eq!(lines[2], "  done       3      3          3         3");
        assert_eq!(lines.len(), 5);
    }

    #[test]
    fn next_step_follows_from_the_counts() {
        assert_eq!(next_steps(&view(0, 0)), ["import pairs.csv"]);
        assert_eq!(next_steps(&view(0, 2)), ["run"]);
        let mut done = view(2, 0);
        let steps = next_steps(&done);
        assert!(steps[0].starts_with("review --reviewer "), "{steps:?}");
        assert_eq!(steps[1..], ["report"]);
        done.counts.verdicts.insert(Verdict::Pass, 1);
        assert_eq!(next_steps(&done), ["report"]);
        assert_eq!(review_step(Some("lê văn")), "review --reviewer 'lê văn'");
        assert_eq!(review_step(None), "review --reviewer me");
    }

    #[test]
    fn doubtful_pairs_are_said_with_how_to_look_at_them() {
        let mut doubtful = view(3, 0);
        assert!(!screen(&doubtful, "demo", Palette::PLAIN).contains("doubtful"));
        doubtful.counts.doubtful = 1;
        let text = screen(&doubtful, "demo", Palette::PLAIN);
        let line = "doubtful   1 done pair with a confidence below 0.5\n";
        assert!(text.ends_with(line), "{text}");
        assert_eq!(next_steps(&doubtful)[0], "contact-sheet --order confidence");
    }
}
