//! Which inputs of a project are at their places, as the pages say it after they were looked at.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use maud::{Markup, html};

use super::address::encoded;
use super::components::grouped;
use super::failure::{AppFailure, AppResult};
use super::projects::OpenProject;
use super::visit::Visit;
use crate::on_thread::read_on_thread;
use mocban_core::domain::{UnixMillis, one_line};
use mocban_project::input_places::InputPlaces;

/// How long a page that is read again and again shows what was found. The button looks anew.
const MAX_AGE: Duration = Duration::from_secs(10);

/// What was found last, by the folder of the project.
#[derive(Debug, Default)]
pub(super) struct LookedInputs(Mutex<BTreeMap<PathBuf, LastLook>>);

/// What was found for a press of the button.
#[derive(Debug, Clone)]
struct LastLook {
    pressed: UnixMillis,
    ended: Instant,
    places: Arc<InputPlaces>,
}

impl LookedInputs {
    /// Looks at the inputs of a project, unless that was just done for the same press of the button.
    pub(super) async fn look(
        &self,
        open: &OpenProject,
        pressed: UnixMillis,
    ) -> AppResult<Arc<InputPlaces>> {
        if let Some(places) = self.kept(&open.dir, pressed, Instant::now()) {
            return Ok(places);
        }
        let (project, catalog) = (open.project.clone(), open.catalog.clone());
        let found = read_on_thread(async move || InputPlaces::of_project(&project, &catalog).await);
        let found = found.await;
        let places = found.map_err(|error| AppFailure::of(error, &open.dir))?;
        let places = Arc::new(places);
        self.keep(&open.dir, pressed, Instant::now(), Arc::clone(&places));
        Ok(places)
    }

    fn kept(&self, dir: &Path, pressed: UnixMillis, now: Instant) -> Option<Arc<InputPlaces>> {
        let last = self.lock().get(dir).cloned()?;
        let is_new = last.pressed == pressed && now.duration_since(last.ended) < MAX_AGE;
        is_new.then_some(last.places)
    }

    fn keep(&self, dir: &Path, pressed: UnixMillis, ended: Instant, places: Arc<InputPlaces>) {
        let look = LastLook {
            pressed,
            ended,
            places,
        };
        self.lock().insert(dir.to_owned(), look);
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<PathBuf, LastLook>> {
        // Each change is a single insertion.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Says how many files were looked at, of how many.
pub(super) fn looked_at_text(places: &InputPlaces) -> [String; 2] {
    let [looked_at, known] = [places.looked_at, places.known].map(|number| grouped(number as u64));
    let [of, of_vi] = if places.has_more {
        ["of more than", "trên hơn"]
    } else {
        ["of", "trên"]
    };
    [
        format!("Files that were looked at: {looked_at} {of} {known}"),
        format!("Số tệp đã kiểm tra: {looked_at} {of_vi} {known}"),
    ]
}

/// Returns the paths of the first missing files, which are not all if dots follow.
pub(super) fn first_missing(places: &InputPlaces) -> String {
    let names = places.first.iter().map(|path| one_line(path).into_owned());
    let dots = (places.missing > places.first.len()).then(|| "…".to_owned());
    names.chain(dots).collect::<Vec<_>>().join(", ")
}

/// Says what a run has found that looked for changed files: missing files, or that nothing has changed. `key` names the project.
pub(super) fn looked_part(
    visit: &Visit,
    key: &str,
    places: &InputPlaces,
    is_unchanged: bool,
) -> Markup {
    let [english, vietnamese] = looked_at_text(places);
    let looked_at = visit.t(&english, &vietnamese);
    html! {
        @if places.missing > 0 {
            div.notice.warn #missing-files role="status" {
                p {
                    (visit.t("Missing files", "Số tệp bị thiếu")) ": " b { (grouped(places.missing as u64)) } " (" (first_missing(places)) "). "
                    (visit.t("Put them back, or import them again from where they are now.", "Hãy đưa chúng về chỗ cũ, hoặc nhập lại từ chỗ hiện có tệp."))
                    @if !places.is_of_all() { " " (looked_at) "." }
                }
                p.row { a href={ (visit.root) "import?project=" (encoded(key)) } { (visit.t("Import", "Nhập dữ liệu")) } }
            }
        }
        @if is_unchanged {
            p.good #no-change role="status" {
                @if places.missing > 0 {
                    (visit.t("No other file has changed.", "Không có tệp nào khác thay đổi."))
                } @else if places.is_of_all() {
                    (visit.t("No file has changed, and none is missing.", "Không có tệp nào thay đổi hay bị thiếu."))
                } @else {
                    (visit.t("No file has changed.", "Không có tệp nào thay đổi.")) " "
                    (looked_at) ". "
                    @if places.looked_at > 0 { (visit.t("None of these is missing.", "Không thiếu tệp nào trong số này.")) }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;
    use std::time::Instant;

    use super::{LookedInputs, MAX_AGE, looked_part};
    use crate::app::visit::Visit;
    use crate::review::Language;
    use mocban_project::input_places::InputPlaces;

    /// Returns what was found of 12 files, of which some were looked at and the first are missing.
    fn found(looked_at: usize, missing: usize) -> InputPlaces {
        InputPlaces {
            known: 12,
            has_more: false,
            looked_at,
            missing,
            missing_inside: 0,
            first: (0..missing.min(3)).map(|i| format!("{i}.stl")).collect(),
        }
    }

    #[test]
    fn missing_files_are_named_although_nothing_has_changed() {
        for (places, is_unchanged, english, vietnamese) in [
            (
                found(12, 0),
                true,
                &["No file has changed, and none is missing."][..],
                &["Không có tệp nào thay đổi hay bị thiếu."][..],
            ),
            (
                found(12, 4),
                true,
                &[
                    "Missing files: <b>4</b> (0.stl, 1.stl, 2.stl, …). Put them back",
                    "href=\"./import?project=a%20b\"",
                    "No other file has changed.",
                ][..],
                &[
                    "Số tệp bị thiếu: <b>4</b> (0.stl, 1.stl, 2.stl, …). Hãy đưa chúng về",
                    "Không có tệp nào khác thay đổi.",
                ][..],
            ),
            (
                found(5, 1),
                false,
                &["<b>1</b> (0.stl). ", "Files that were looked at: 5 of 12."][..],
                &["<b>1</b> (0.stl). ", "Số tệp đã kiểm tra: 5 trên 12."][..],
            ),
            (
                found(5, 0),
                true,
                &["Files that were looked at: 5 of 12. None of these is missing."][..],
                &["Số tệp đã kiểm tra: 5 trên 12. Không thiếu tệp nào trong số này."][..],
            ),
        ] {
            for (language, parts) in Language::ALL.into_iter().zip([english, vietnamese]) {
                let visit = Visit::in_language(language);
                let shown = looked_part(&visit, "a b", &places, is_unchanged).into_string();
                for part in parts {
                    assert!(shown.contains(part), "{part}: {shown}");
                }
                assert_eq!(shown.contains("no-change"), is_unchanged, "{shown}");
            }
        }
    }

    #[test]
    fn files_are_looked_at_again_for_each_press_and_after_a_while() {
        let (looked, dir, now) = (LookedInputs::default(), Path::new("p"), Instant::now());
        looked.keep(dir, 7, now, Arc::new(found(12, 1)));
        let is_kept = |dir, pressed, now| looked.kept(dir, pressed, now).is_some();
        assert!(is_kept(dir, 7, now));
        assert!(!is_kept(dir, 8, now) && !is_kept(Path::new("q"), 7, now));
        assert!(!is_kept(dir, 7, now + MAX_AGE));
    }
}
