//! HTML of the review page. The page is the same for every item, and a script fills in the current item.

use maud::{Markup, html};

use super::i18n::Language;
use super::options::QueueOptions;
use super::page_dialogs::{confirm, guide, help, jump};
use crate::local_server::document;
use mocban_core::domain::{Reason, ReviewOrder, one_line};

/// Display modes with a button, in the order of their keys.
const MODES: &str = "two_up overlay edges onion checker difference reveal";
/// Switches that work in every display mode.
const SWITCHES: &str = "auto_flicker angle_guides stroke_map zoom align";

/// Returns the review page. With `project_page`, it links to the project in the app.
pub(super) fn review(
    options: &QueueOptions,
    project_page: Option<&str>,
    language: Language,
) -> Markup {
    let title = format!(
        "{} · {}",
        language.translate("title"),
        one_line(&options.reviewer)
    );
    let head = html! {
        link rel="stylesheet" href="assets/review.css";
        link rel="stylesheet" href="assets/scan-viewer.css";
        script type="module" src="assets/main.js" {}
    };
    let body = html! {
        a.skip href="#viewer" { (language.translate("skip")) }
        (top(options, project_page, language))
        noscript { p.alert { (language.translate("no_script")) } }
        (modes(language))
        (practice(language))
        main {
            div.side {
                (figure("print", language))
                (figure("print_mask", language))
            }
            (viewer(language))
            div.side {
                (figure("relief", language))
                (figure("depth_mask", language))
            }
        }
        (verdict_bar(language))
        (guide(language))
        (help(language, options.has_attention_checks()))
        (jump(language))
        (confirm(language))
        dialog #scan .scan-dialog aria-label=(language.translate("scan_view")) {}
    };
    document(language.name(), &title, &head, &html! { body { (body) } })
}

fn top(options: &QueueOptions, project_page: Option<&str>, language: Language) -> Markup {
    let other = language.other();
    let label = match options.order {
        ReviewOrder::Random => None,
        ReviewOrder::LeastConfident => Some(language.translate("least_confident_label")),
        ReviewOrder::Adjudicate => Some(language.translate("adjudicate_label")),
    };
    html! {
        header {
            @if let Some(page) = project_page { a href=(page) { (language.translate("to_project")) } }
            h1 #pair { (language.translate("loading")) }
            span #progress {}
            progress #bar value="0" max="1" aria-label=(language.translate("progress_bar")) {}
            @if let Some(label) = label { strong.label { (label) } }
            strong #fault-shortage .label hidden {}
            span.spacer {}
            span #pace {}
            span #saved .saved role="status" {}
            span { (language.translate("reviewer")) ": " b { (one_line(&options.reviewer)) } }
            a #language href={ "?lang=" (other.name()) } hreflang=(other.name()) lang=(other.name()) {
                (language.translate("other_language"))
            }
            (button("guide", language))
            (button("help", language))
        }
    }
}

/// Returns a button for an action, labelled with its name and key.
fn button(action: &'static str, language: Language) -> Markup {
    html! {
        button type="button" data-action=(action) {
            (language.translate(action)) " " kbd data-key=(action) {}
        }
    }
}

fn figure(layer: &'static str, language: Language) -> Markup {
    html! {
        figure {
            figcaption { (language.translate(layer)) }
            canvas id={ "side-" (layer) } role="img" aria-label=(language.translate(layer)) {}
        }
    }
}

fn viewer(language: Language) -> Markup {
    html! {
        section #viewer tabindex="-1" aria-label=(language.translate("viewer")) {
            div.picture {
                canvas #canvas role="img" aria-label=(language.translate("viewer")) {}
                div #end .end tabindex="0" role="region" aria-label=(language.translate("summary")) hidden {}
            }
            p.caption { span #legend {} }
        }
    }
}

/// Returns the bar of the practice round: the answer to each example, and why.
fn practice(language: Language) -> Markup {
    html! {
        section #practice .practice aria-label=(language.translate("practice_round")) hidden {
            p #practice-text role="status" {}
            button #practice-next type="button" { (language.translate("next_example")) " " kbd { "⏎" } }
            button #practice-skip type="button" { (language.translate("skip_practice")) " " kbd { "Esc" } }
        }
    }
}

fn modes(language: Language) -> Markup {
    html! {
        section.modes aria-label=(language.translate("modes")) {
            @for mode in MODES.split_whitespace() { (toggle(mode, language)) }
            span.divider {}
            @for switch in SWITCHES.split_whitespace() { (toggle(switch, language)) }
            (button("scan_view", language))
        }
    }
}

fn toggle(action: &'static str, language: Language) -> Markup {
    html! {
        button type="button" data-action=(action) aria-pressed="false" {
            (language.translate(action)) " " kbd data-key=(action) {}
        }
    }
}

fn verdict_bar(language: Language) -> Markup {
    html! {
        footer {
            p #alert .alert role="alert" hidden {}
            div.verdicts role="group" aria-label=(language.translate("question")) {
                span.question { (language.translate("question")) }
                (verdict("pass", "✓", language))
                (verdict("fail", "✗", language))
                (verdict("unsure", "?", language))
                span.spacer {}
                (button("note", language))
                (button("undo", language))
            }
            p #hint .hint hidden {}
            (alignment_bar(language))
            div #reasons .reasons role="group" aria-label=(language.translate("reasons")) {
                span { (language.translate("reasons")) }
                @for reason in Reason::ALL { (button(reason.name(), language)) }
            }
            div #note-row hidden {
                label for="note" { (language.translate("note")) }
                input #note type="text" maxlength="2000" autocomplete="off";
                span { (language.translate("note_hint")) }
            }
            nav.history aria-label=(language.translate("history")) {
                (button("previous", language))
                ol #history {}
                (button("next", language))
                (button("jump", language))
                (button("details", language))
            }
            p #live .live aria-live="polite" {}
        }
    }
}

/// Steps of the alignment editor with their signs.
const ALIGNMENT_STEPS: [(&str, &str); 10] = [
    ("move_left", "←"),
    ("move_right", "→"),
    ("move_up", "↑"),
    ("move_down", "↓"),
    ("rotate_left", "↺"),
    ("rotate_right", "↻"),
    ("smaller", "−"),
    ("larger", "+"),
    ("mirror", "⇋"),
    ("reset", "⟲"),
];

/// Returns the buttons of the alignment editor, for people who use no keyboard.
fn alignment_bar(language: Language) -> Markup {
    html! {
        div #alignment .alignment role="group" aria-label=(language.translate("manual_alignment")) hidden {
            @for (step, sign) in ALIGNMENT_STEPS {
                button type="button" data-align=(step) {
                    span aria-hidden="true" { (sign) } " " (language.translate(step))
                }
            }
            label { input #alignment-fine type="checkbox"; " " (language.translate("small_steps")) }
            span.spacer {}
            (button("save", language))
            (button("cancel", language))
        }
    }
}

fn verdict(action: &'static str, sign: &str, language: Language) -> Markup {
    html! {
        button.verdict type="button" data-action=(action) {
            span aria-hidden="true" { (sign) } " " (language.translate(action)) " " kbd data-key=(action) {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::review;
    use crate::review::{CheckRates, Language, QueueOptions};
    use mocban_core::domain::ReviewOrder;

    fn options(order: ReviewOrder, faults: f64) -> QueueOptions {
        QueueOptions {
            reviewer: "lan".to_owned(),
            metrics: Vec::new(),
            order,
            pairs: None,
            seed: 1,
            sample: None,
            rates: CheckRates {
                faults,
                duplicates: 0.0,
            },
        }
    }

    /// Returns the HTML with one element per line, for readable snapshots.
    fn lines(html: &str) -> String {
        html.replace("><", ">\n<")
    }

    #[test]
    fn page_in_english() {
        let page = review(&options(ReviewOrder::Random, 0.04), None, Language::English);
        insta::assert_snapshot!(lines(&page.into_string()));
    }

    #[test]
    fn page_in_vietnamese() {
        let options = options(ReviewOrder::LeastConfident, 0.0);
        let page = review(&options, None, Language::Vietnamese);
        insta::assert_snapshot!(lines(&page.into_string()));
    }

    #[test]
    fn conflicts_are_labelled() {
        let page = review(
            &options(ReviewOrder::Adjudicate, 0.04),
            Some("../../../"),
            Language::English,
        );
        let page = page.into_string();
        assert!(page.contains("Disagreements of other reviewers"), "{page}");
        assert!(!page.contains("attention checks"), "{page}");
        assert!(
            page.contains("<a href=\"../../../\">← Project</a>"),
            "{page}"
        );
    }
}
