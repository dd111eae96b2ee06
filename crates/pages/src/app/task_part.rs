//! What a page shows of long work.

use maud::{Markup, html};

use super::tasks::TaskState;
use super::visit::Visit;
use mocban_core::domain::one_line;

/// Returns what a page shows of a task.
pub(super) fn task_part(visit: &Visit, state: Option<&TaskState>) -> Markup {
    html! {
        @match state {
            None => {},
            Some(TaskState::Running) => div.notice role="status" data-task="running" {
                p { (visit.t("Working…", "Đang làm…")) }
                progress aria-label=(visit.t("Working", "Đang làm")) {}
            },
            Some(TaskState::Done(done)) => div.notice.good[!done.is_warning].bad[done.is_warning] role="status" data-task="done" {
                @for line in &done.lines { p { (one_line(&line[visit.index()])) } }
            },
            Some(TaskState::Failed(why)) => div.notice.bad role="alert" data-task="failed" { p { (why.text(visit.language)) } },
        }
    }
}
