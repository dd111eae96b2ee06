//! A project. Each call opens its catalog, so that nothing stays open between calls.

use std::future::Future;
use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use serde_json::{Value, json};

use crate::alignment::NativeAlignment;
use crate::compute::compute_with_events;
use crate::failure::{project_failure, raise, wrong_argument};
use crate::mesh::unit as mesh_unit;
use crate::python_events::{PythonEvent, PythonEvents};
use crate::{log, stored_block, stored_pair};
use mocban_catalog::{NewVerdict, ReviewContext};
use mocban_core::domain::cancel::CancelToken;
use mocban_core::domain::{ContentHash, ErrorCode, ThresholdMetric, any_case};
use mocban_export::{ExportFormat, ExportOptions};
use mocban_project::import_blocks::ImportedBlock;
use mocban_project::import_pairs::AllowedChanges;
use mocban_project::input_paths::in_existing_form;
use mocban_project::location::Location;
use mocban_project::report::{ReportOptions, report};
use mocban_project::run::{PreparedRun, options};
use mocban_project::status::ProjectStatus;
use mocban_project::verdict_words;
use mocban_project::verdicts::{self, RecordedVerdict};
use mocban_project::{ProjectError, ProjectResult, export};
use mocban_results::IntervalMethod;
use mocban_runner::{Stop, StopLevel};

/// A project folder and its settings.
#[pyclass(frozen, module = "mocban._native")]
pub(crate) struct NativeProject {
    location: Location,
}

/// Parses an argument, such as the name of a format, in any case.
fn parsed<T: std::str::FromStr>(py: Python<'_>, name: &str) -> PyResult<T>
where
    T::Err: std::fmt::Display,
{
    any_case(name).map_err(|error: T::Err| wrong_argument(py, &error.to_string()))
}

/// Parses the name of a metric, in any case.
fn parsed_metric(py: Python<'_>, name: &str) -> PyResult<ThresholdMetric> {
    verdict_words::metric(name).map_err(|text| wrong_argument(py, &text))
}

impl NativeProject {
    /// Runs a function of the project library in a runtime of its own. After a signal, calls `stop`.
    fn call<T: Send + 'static, F: Future<Output = ProjectResult<T>>>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(Location, PythonEvents, Arc<Stop>) -> F + Send + 'static,
        mut on_event: impl FnMut(&str) -> PyResult<()>,
        also_stop: impl Fn(&CancelToken),
    ) -> PyResult<ProjectResult<T>> {
        let (location, stop) = (self.location.clone(), Arc::new(Stop::new()));
        let inner = Arc::clone(&stop);
        let body = move |events| {
            let mut builder = tokio::runtime::Builder::new_multi_thread();
            let runtime = builder.worker_threads(2).enable_all().build();
            let runtime = runtime.map_err(|error| ProjectError::unexpected(error.to_string()))?;
            runtime.block_on(work(location, PythonEvents(events), inner))
        };
        let pass_on = |event| match event {
            PythonEvent::Run(json) => on_event(&json),
            PythonEvent::Warning(text) => log::write(py, [(log::WARNING, text)]),
        };
        compute_with_events(py, body, pass_on, |token| {
            stop.escalate();
            also_stop(token);
        })
    }

    /// Runs a function of the project library until it ends or a signal comes, which drops its future and cancels its
    /// computations: a transaction is rolled back unless its commit has begun, and outputs are not
    /// replaced.
    fn outcome<T: Send + 'static, F: Future<Output = ProjectResult<T>>>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(Location, PythonEvents) -> F + Send + 'static,
    ) -> PyResult<ProjectResult<T>> {
        let until_stopped = |location, events, stop: Arc<Stop>| async move {
            tokio::select! {
                biased;
                result = work(location, events) => result,
                // The exception of the signal is raised in place of this error.
                () = stop.reached(StopLevel::Drain) => Err(ProjectError::unexpected("stopped")),
            }
        };
        self.call(py, until_stopped, |_| Ok(()), CancelToken::cancel)
    }

    /// Like `outcome`; raises the exception of an error.
    fn simple<T: Send + 'static, F: Future<Output = ProjectResult<T>>>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(Location, PythonEvents) -> F + Send + 'static,
    ) -> PyResult<T> {
        let result = self.outcome(py, work)?;
        result.map_err(|error| self.failure(py, &error))
    }

    fn failure(&self, py: Python<'_>, error: &ProjectError) -> PyErr {
        project_failure(py, error, &self.location.dir)
    }
}

/// Turns the request for a drain into one for an immediate stop.
async fn stop_soon(stop: Arc<Stop>) {
    stop.reached(StopLevel::Drain).await;
    while stop.level() < StopLevel::Now {
        stop.escalate();
    }
}

#[pymethods]
impl NativeProject {
    /// Names a project folder, and the address of its catalog if that is not in the settings.
    #[new]
    fn new(dir: PathBuf, catalog: Option<String>) -> Self {
        let mut location = Location::new(dir);
        location.catalog = catalog;
        Self { location }
    }

    /// Opens the catalog once, so that errors come early.
    fn check(&self, py: Python<'_>, readonly: bool) -> PyResult<()> {
        self.simple(py, move |location, _| async move {
            let opened = if readonly {
                location.open_read_only().await
            } else {
                location.open().await
            };
            opened?.1.close().await;
            Ok(())
        })
    }

    /// Returns the counts of pairs, with failures, in JSON.
    fn status(&self, py: Python<'_>) -> PyResult<String> {
        self.simple(py, |location, _| async move {
            let (project, catalog) = location.open_read_only().await?;
            let status = ProjectStatus::read(&project, &catalog, true, &location, None).await?;
            catalog.close().await;
            Ok(status.json(true)?.to_string())
        })
    }

    /// Returns the settings in JSON.
    fn settings(&self, py: Python<'_>) -> PyResult<String> {
        self.simple(py, |location, _| async move {
            Ok(serde_json::to_string(&location.settings()?.config)?)
        })
    }

    /// Returns everything about a pair in JSON.
    fn pair(&self, py: Python<'_>, id: String) -> PyResult<String> {
        self.simple(py, |location, _| async move {
            let detail = stored_pair::detail(&id, &location).await?;
            Ok(serde_json::to_string(&detail)?)
        })
    }

    /// Returns the alignment of a finished pair.
    fn alignment(&self, py: Python<'_>, id: String) -> PyResult<NativeAlignment> {
        let (pair, print) = self.simple(py, |location, _| async move {
            stored_pair::alignment(&id, &location).await
        })?;
        Ok(NativeAlignment {
            pair: Arc::new(pair),
            print: Arc::new(print),
        })
    }

    /// Returns the log of verdicts in JSON.
    fn verdicts(&self, py: Python<'_>) -> PyResult<String> {
        self.simple(py, |location, _| async move {
            let log = verdicts::log(None, &location).await?;
            Ok(serde_json::to_string(&log.events)?)
        })
    }

    /// Records a verdict. Returns whether it is new.
    #[expect(clippy::too_many_arguments, reason = "the fields of a verdict")]
    fn add_verdict(
        &self,
        py: Python<'_>,
        id: String,
        metric: Option<&str>,
        verdict: &str,
        reviewer: String,
        reason: Option<&str>,
        note: Option<String>,
        expect: Option<&str>,
        new_reviewer: bool,
        adjudicate: bool,
    ) -> PyResult<bool> {
        let metric = metric.map(|name| parsed_metric(py, name)).transpose()?;
        let verdict = verdict_words::verdict(verdict).map_err(|text| wrong_argument(py, &text))?;
        let reason = reason.map(verdict_words::reason).transpose();
        let reason = reason.map_err(|text| wrong_argument(py, &text))?;
        let judged: Option<ContentHash> = expect.map(|hash| parsed(py, hash)).transpose()?;
        let name = id.clone();
        let recorded = self.outcome(py, move |location, _| async move {
            let new = |pair| NewVerdict {
                pair,
                metric,
                verdict,
                reviewer,
                reason,
                note,
                context: ReviewContext::default(),
                at: None,
            };
            if !adjudicate {
                let recorded = verdicts::record(&id, judged, new, new_reviewer, &location);
                return Ok(recorded.await?.1);
            }
            let settled = verdicts::settle(&id, judged, new, new_reviewer, &location);
            let is_stale = settled.await?.1.is_empty();
            Ok([RecordedVerdict::New, RecordedVerdict::Stale][usize::from(is_stale)])
        })?;
        // The library refuses other arguments, such as the name of a reviewer.
        let recorded = recorded.map_err(|error| match error.code() {
            ErrorCode::Usage => wrong_argument(py, &error.text(&self.location.dir)),
            _ => self.failure(py, &error),
        })?;
        if recorded == RecordedVerdict::Stale {
            let text = format!(
                "the result of pair {name} has changed since it was read; look at it again before you judge it"
            );
            return Err(raise(
                py,
                "StaleResult",
                "stale_result",
                &text,
                Some(&self.location.dir),
            ));
        }
        Ok(recorded == RecordedVerdict::New)
    }

    /// Imports rows in JSON Lines. Returns what changed, in JSON.
    fn import_pairs(
        &self,
        py: Python<'_>,
        file: PathBuf,
        rows: Vec<u8>,
        allow_missing: bool,
        allow_changed_files: bool,
        replace: bool,
    ) -> PyResult<String> {
        let allowed = AllowedChanges {
            missing: allow_missing,
            files: allow_changed_files,
            replace,
        };
        self.simple(py, move |location, events| async move {
            stored_pair::import(file, rows, allowed, &location, &events).await
        })
    }

    /// Imports a block. Returns what changed, in JSON.
    #[expect(clippy::too_many_arguments, reason = "the files of a block")]
    fn import_block(
        &self,
        py: Python<'_>,
        mesh: PathBuf,
        page: PathBuf,
        labels: Option<PathBuf>,
        name: Option<String>,
        unit: Option<&str>,
        side: Option<&str>,
    ) -> PyResult<String> {
        let block = ImportedBlock {
            mesh,
            page,
            labels,
            side: side.map(|name| parsed(py, name)).transpose()?,
            name,
            unit: mesh_unit(py, unit)?,
        };
        let files = [
            ("mesh", Some(block.mesh.clone())),
            ("page", Some(block.page.clone())),
            ("labels", block.labels.clone()),
        ];
        let imported = self.outcome(py, |location, events| async move {
            stored_block::import(block, &location, &events).await
        })?;
        imported.map_err(|error| {
            // The import also finds files by other forms of their names.
            let gone = |path: &PathBuf| {
                py.detach(|| matches!(in_existing_form(path).try_exists(), Ok(false)))
            };
            let mut files = files.iter();
            let found = files.find_map(|(what, path)| Some((what, path.clone().filter(&gone)?)));
            let Some((what, path)) = found else {
                return self.failure(py, &error);
            };
            let text = format!(
                "{} is not there; give the file of the {what}",
                path.display()
            );
            raise(py, "InputNotFound", "not_found", &text, Some(&path))
        })
    }

    /// Returns everything about a block, and its characters, in JSON.
    fn block(&self, py: Python<'_>, id: String) -> PyResult<String> {
        self.simple(py, |location, _| async move {
            stored_block::detail(&id, &location).await
        })
    }

    /// Runs pairs until none is left. Returns the summary in JSON.
    fn run(
        &self,
        py: Python<'_>,
        ids: Vec<String>,
        workers: Option<usize>,
        progress: Option<Bound<'_, PyAny>>,
        stop_at_once: bool,
    ) -> PyResult<String> {
        let on_event = |event: &str| {
            progress
                .as_ref()
                .map_or(Ok(()), |call| call.call1((event,)).map(drop))
        };
        let work = move |location: Location, events: PythonEvents, stop: Arc<Stop>| async move {
            if stop_at_once {
                tokio::spawn(stop_soon(Arc::clone(&stop)));
            }
            let mut options = options(&location.settings()?.config);
            if let Some(workers) = workers {
                options.workers = workers;
            }
            let run = PreparedRun::new(&ids, options, false, &location, &events).await?;
            let outcome = run.run(&stop, &events).await?;
            Ok(serde_json::to_string(&outcome.summary)?)
        };
        let result = self.call(py, work, on_event, |_| ())?;
        result.map_err(|error| self.failure(py, &error))
    }

    /// Returns the report in a format.
    fn report(&self, py: Python<'_>, format: String) -> PyResult<String> {
        let format = parsed(py, &format)?;
        self.simple(py, move |location, events| async move {
            let options = ReportOptions {
                format,
                interval: IntervalMethod::default(),
                with_times: false,
            };
            Ok(report(options, None, &location, &events).await?.text)
        })
    }

    /// Exports pairs to a folder. Returns what was written and left out, in JSON.
    fn export(
        &self,
        py: Python<'_>,
        dir: PathBuf,
        formats: Vec<String>,
        metrics: Vec<String>,
        only: String,
        images: bool,
    ) -> PyResult<String> {
        let formats = formats.iter().map(|name| parsed(py, name));
        let formats: Vec<ExportFormat> = formats.collect::<PyResult<_>>()?;
        let metrics = metrics.iter().map(|name| parsed_metric(py, name));
        let metrics: Vec<ThresholdMetric> = metrics.collect::<PyResult<_>>()?;
        let only = parsed(py, &only)?;
        self.simple(py, move |location, events| async move {
            let limits = location.settings()?.config.limits;
            let options = ExportOptions {
                only,
                images,
                ..ExportOptions::all_of(&metrics, limits)
            };
            let exported = export::export(&dir, &formats, options, &location, &events).await?;
            let summary = exported.summary;
            let unreadable = summary.unreadable.iter();
            let unreadable: Vec<Value> = unreadable
                .map(|(id, why)| json!({"id": id, "error": why}))
                .collect();
            let counts = json!({
                "done": summary.pairs.done,
                "without_result": summary.pairs.without_result,
                "left_out": summary.pairs.left_out,
                "unreadable": unreadable,
                "kept_earlier": summary.kept_earlier,
            });
            Ok(counts.to_string())
        })
    }
}
