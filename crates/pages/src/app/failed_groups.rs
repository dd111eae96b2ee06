//! Failed pairs by reason, with pictures of examples and what helps.

use maud::{Markup, html};

use super::address::encoded;
use super::components::{action_form, grouped, stored_message};
use super::remedies::{MendedPairs, import_address, pair_remedy, unit_link};
use super::scan_correction::ScanQuestion;
use super::visit::Visit;
use mocban_catalog::{Catalog, PairFilter, PairOrder, PairResults, Result};
use mocban_core::domain::{FailureClass, JobStatus, Stage, ThresholdMetric, one_line};
use mocban_project::failures::may_succeed_unchanged;

/// Number of failed pairs that are shown as examples of each class.
const EXAMPLES: usize = 3;
/// Most failures of a class among which one that names the unit is searched.
const SEARCHED: usize = 1000;

/// The pairs that failed with a class.
#[derive(Debug)]
pub(super) struct FailedGroup {
    class: FailureClass,
    number: u64,
    examples: Vec<PairResults>,
    /// Whether the message of one of the first pairs names the unit. Searched only where it decides what is offered.
    names_unit: bool,
}

impl FailedGroup {
    /// Reads all groups, the largest first.
    pub(super) async fn read_all(catalog: &Catalog) -> Result<Vec<Self>> {
        let mut classes = catalog.failure_counts().await?;
        classes.sort_by_key(|(class, number)| (std::cmp::Reverse(*number), *class));
        let mut groups = Vec::new();
        for (class, number) in classes {
            let filter = PairFilter {
                class: Some(class),
                statuses: vec![JobStatus::Quarantined],
                ..PairFilter::default()
            };
            let metric = ThresholdMetric::DEFAULT;
            let list = catalog.pair_list(&filter, PairOrder::Imported, metric, None, EXAMPLES);
            let mut group = Self {
                class,
                number,
                examples: list.await?.pairs,
                names_unit: false,
            };
            if !group.are_cut() && class != FailureClass::NoSolution {
                let unit = catalog.failed_scans(class, true, [SEARCHED, 1]).await?;
                group.names_unit = !unit.is_empty();
            }
            groups.push(group);
        }
        Ok(groups)
    }

    fn are_cut(&self) -> bool {
        self.examples.iter().all(is_cut)
    }

    /// Returns what a person may correct in the scans of all pairs of the group. Pairs that were cut from a block have its unit
    /// and its side.
    fn questions(&self) -> &'static [ScanQuestion] {
        let is_unsolved = self.class == FailureClass::NoSolution;
        if self.are_cut() || !(is_unsolved || self.names_unit) {
            &[]
        } else if is_unsolved {
            &ScanQuestion::ALL
        } else {
            &[ScanQuestion::Unit]
        }
    }
}

/// Returns whether a pair was cut from a block.
fn is_cut(pair: &PairResults) -> bool {
    pair.attributes.prior.is_some()
}

/// Returns the groups with their examples and what helps. `key` names the project.
pub(super) fn failed_groups(visit: &Visit, key: &str, groups: &[FailedGroup]) -> Markup {
    html! {
        @if !groups.is_empty() {
            section #failures {
                h2 { (visit.t("Failed pairs by reason", "Các cặp lỗi theo lý do")) }
                @for group in groups { (group_part(visit, key, group)) }
            }
        }
    }
}

fn group_part(visit: &Visit, key: &str, group: &FailedGroup) -> Markup {
    let class = group.class;
    let examples: Vec<&PairResults> = group.examples.iter().collect();
    html! {
        article.card {
            h3 { (grouped(group.number)) " · " (visit.class(class)) }
            (pair_remedy(visit, key, class, group.number, &examples))
            ul.examples { @for pair in &group.examples { (example(visit, key, class, pair)) } }
            div.row {
                a.button href={ "pairs?view=table&state=failed&class=" (class) } { (visit.t("Show them", "Xem các cặp này")) }
                (action_form("actions/retry", "inline", &html! {
                    input type="hidden" name="class" value=(class);
                    button class=[may_succeed_unchanged(class).then_some("primary")] { (visit.t("Try these again", "Thử lại các cặp này")) }
                }))
                @for question in group.questions() {
                    a.button href={ "correct?what=" (question.name()) "&class=" (class) } { (question.title(visit, group.number)) }
                }
            }
        }
    }
}

fn example(visit: &Visit, key: &str, class: FailureClass, pair: &PairResults) -> Markup {
    let name = pair.attributes.name.as_str();
    let message = pair.failure.as_ref().map(|stored| &stored.failure.message);
    let is_of_file = matches!(
        class,
        FailureClass::BadInput | FailureClass::NoSolution | FailureClass::Io
    );
    let replace = visit.t("Replace the scan or the print", "Thay bản quét hoặc bản in");
    html! {
        li {
            p {
                a href={ "pair/" (encoded(name)) "/" } { (one_line(name)) }
                @if let Some(message) = message { ": " (stored_message(visit, message)) }
            }
            div.row { (pictures(visit, pair)) }
            @if is_of_file && !is_cut(pair) {
                p.row {
                    @if let Some(link) = unit_link(visit, "", pair) { (link) }
                    a href=(import_address(visit, key, Some(MendedPairs::Pair(name)))) aria-label={ (replace) ": " (one_line(name)) } { (replace) }
                }
            }
        }
    }
}

/// Returns the print of a pair, and its depth map or, if there is none, its scan. The browser loads them when they are in sight.
fn pictures(visit: &Visit, pair: &PairResults) -> Markup {
    let name = pair.attributes.name.as_str();
    let relief = if pair.stage(Stage::Depth).is_some() {
        ("relief", visit.t("Relief (depth)", "Mặt khắc (độ sâu)"))
    } else {
        (
            "scan",
            visit.t("Scan, seen from above", "Bản quét, nhìn từ trên"),
        )
    };
    let print = ("thumb", visit.t("Print", "Bản in"));
    html! {
        @for (picture, what) in [print, relief] {
            figure {
                img loading="lazy" src={ "pair/" (encoded(name)) "/picture/" (picture) "-" (ThresholdMetric::DEFAULT) } alt={ (what) ": " (one_line(name)) } width="120" height="120";
                figcaption.muted { (what) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{FailedGroup, failed_groups};
    use crate::app::visit::Visit;
    use crate::review::Language;
    use mocban_core::domain::FailureClass;
    use mocban_results::test_fixtures::{self as fixtures, with_confidence};

    fn group(class: FailureClass, names_unit: bool) -> FailedGroup {
        FailedGroup {
            class,
            number: 2,
            examples: vec![with_confidence("chữ 1", 0.9)],
            names_unit,
        }
    }

    fn shown(language: Language, group: FailedGroup) -> String {
        let visit = Visit::in_language(language);
        failed_groups(&visit, "p 1", &[group]).into_string()
    }

    #[test]
    fn an_example_has_its_pictures_and_the_way_to_another_file() {
        for language in Language::ALL {
            let shown = shown(language, group(FailureClass::BadInput, false));
            for part in [
                "src=\"pair/ch%E1%BB%AF%201/picture/thumb-ensemble\"",
                "loading=\"lazy\"",
                "import?project=p%201&amp;mend=ch%E1%BB%AF%201",
            ] {
                assert!(shown.contains(part), "{part}: {shown}");
            }
            assert!(!shown.contains("correct?"), "{shown}");
        }
        let shown = shown(Language::English, group(FailureClass::Bug, false));
        assert!(!shown.contains("mend="), "{shown}");
    }

    #[test]
    fn an_example_that_failed_because_of_its_unit_leads_to_another_one() {
        let message = "with the unit m, the scan is 13.4 m long; correct the unit (perhaps mm), and import it again";
        let link = "correct?what=unit&amp;pair=ch%E1%BB%AF%201";
        for language in Language::ALL {
            let mut failed = group(FailureClass::BadInput, true);
            failed.examples = vec![fixtures::failed("chữ 1", FailureClass::BadInput, message)];
            let shown = shown(language, failed);
            assert!(shown.contains(link), "{shown}");
        }
    }

    #[test]
    fn unit_and_side_are_offered_where_they_are_likely_wrong() {
        let unit = "correct?what=unit&amp;class=";
        let side = "correct?what=side&amp;class=";
        for (class, names_unit, has_unit, has_side) in [
            (FailureClass::BadInput, false, false, false),
            (FailureClass::BadInput, true, true, false),
            (FailureClass::NoSolution, false, true, true),
            (FailureClass::Io, false, false, false),
        ] {
            let shown = shown(Language::Vietnamese, group(class, names_unit));
            let found = [unit, side].map(|part| shown.contains(part));
            assert_eq!(found, [has_unit, has_side], "{class} {names_unit}: {shown}");
        }
        let mut cut = group(FailureClass::NoSolution, false);
        cut.examples[0].attributes.prior = Some("{}".to_owned());
        let shown = shown(Language::English, cut);
        assert!(
            !shown.contains("correct?"),
            "its block has the unit: {shown}"
        );
    }
}
