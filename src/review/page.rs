//! The page's HTML. The script fills in what changes; everything here is the same for every card.

use maud::{DOCTYPE, Markup, html};

use super::desk::Desk;
use super::words::Language;
use crate::domain::{Reason, ReviewOrder};

/// Ways to look that have a button, in the order of their keys.
const MODES: [&str; 7] = [
    "two_up",
    "overlay",
    "edges",
    "onion",
    "checker",
    "difference",
    "reveal",
];
/// Switches that lie over a way to look.
const SWITCHES: [&str; 5] = ["rock", "protractor", "strokes", "zoom", "correct"];

/// A whole document.
fn document(language: Language, title: &str, head: &Markup, body: &Markup) -> Markup {
    html! {
        (DOCTYPE)
        html lang=(language.name()) {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                (head)
            }
            body { (body) }
        }
    }
}

/// The page that the start address shows for a moment: going on from here, the cookie goes along.
pub(super) fn onward(language: Language) -> Markup {
    let title = language.say("onward");
    let head = html! { meta http-equiv="refresh" content="0;url=/"; };
    document(
        language,
        title,
        &head,
        &html! { p { a href="/" { (title) } } },
    )
}

/// What a used token gets.
pub(super) fn refused(language: Language) -> Markup {
    let text = language.say("refused");
    document(
        language,
        language.say("title"),
        &html! {},
        &html! { h1 { (text) } },
    )
}

/// The review page.
pub(super) fn review(desk: &Desk, language: Language) -> Markup {
    let title = format!("{} · {}", language.say("title"), desk.deck_options.reviewer);
    let head = html! {
        link rel="stylesheet" href="/assets/review.css";
        link rel="icon" href="/assets/icon.svg";
        script type="module" src="/assets/main.js" {}
    };
    let body = html! {
        a.skip href="#stage" { (language.say("skip")) }
        (top(desk, language))
        noscript { p.alert { (language.say("no_script")) } }
        p #alert .alert role="alert" hidden {}
        (modes(language))
        main {
            div.side {
                (figure("print", language))
                (figure("print_mask", language))
            }
            (stage(language))
            div.side {
                (figure("relief", language))
                (figure("depth_mask", language))
            }
        }
        (verdict_bar(language))
        (help(language, desk.deck_options.tests_the_reviewer()))
        (jump(language))
        p #live .quiet aria-live="polite" {}
    };
    document(language, &title, &head, &body)
}

fn top(desk: &Desk, language: Language) -> Markup {
    let other = language.other();
    let label = match desk.deck_options.order {
        ReviewOrder::Random => None,
        ReviewOrder::LeastConfident => Some(language.say("risk_label")),
        ReviewOrder::Adjudicate => Some(language.say("adjudicate_label")),
    };
    html! {
        header {
            h1 #pair { (language.say("loading")) }
            span #progress {}
            progress #bar value="0" max="1" aria-label=(language.say("title")) {}
            @if let Some(label) = label { strong.label { (label) } }
            span.gap {}
            span #pace {}
            span #saved .saved role="status" { (language.say("saved")) }
            span { (language.say("reviewer")) ": " b { (desk.deck_options.reviewer) } }
            a #language href={ "/?lang=" (other.name()) } hreflang=(other.name()) lang=(other.name()) {
                (language.say("other_language"))
            }
            button type="button" data-do="help" { (language.say("help")) " " kbd data-key="help" {} }
        }
    }
}

fn figure(layer: &'static str, language: Language) -> Markup {
    html! {
        figure {
            figcaption { (language.say(layer)) }
            canvas id={ "side-" (layer) } role="img" aria-label=(language.say(layer)) {}
        }
    }
}

fn stage(language: Language) -> Markup {
    html! {
        section #stage tabindex="-1" aria-label=(language.say("stage")) {
            div.picture {
                canvas #canvas role="img" aria-label=(language.say("stage")) {}
            }
            p.under { span #legend {} span.gap {} span #measure {} }
        }
    }
}

fn modes(language: Language) -> Markup {
    html! {
        div.modes role="group" aria-label=(language.say("modes")) {
            @for mode in MODES { (look(mode, language)) }
            span.rule {}
            @for switch in SWITCHES { (look(switch, language)) }
        }
    }
}

fn look(action: &'static str, language: Language) -> Markup {
    html! {
        button type="button" data-do=(action) aria-pressed="false" {
            (language.say(action)) " " kbd data-key=(action) {}
        }
    }
}

fn verdict_bar(language: Language) -> Markup {
    html! {
        footer {
            div.verdicts role="group" aria-label=(language.say("question")) {
                span.question { (language.say("question")) }
                (verdict("pass", "✓", language))
                (verdict("fail", "✗", language))
                (verdict("unsure", "?", language))
                span.gap {}
                button type="button" data-do="note" { (language.say("note")) " " kbd data-key="note" {} }
                button type="button" data-do="undo" { (language.say("undo")) " " kbd data-key="undo" {} }
            }
            div.reasons role="group" aria-label=(language.say("why")) {
                span { (language.say("why")) }
                @for reason in Reason::ALL {
                    button type="button" data-do=(reason.name()) {
                        (language.say(reason.name())) " " kbd data-key=(reason.name()) {}
                    }
                }
            }
            div #note-row hidden {
                label for="note" { (language.say("note")) }
                input #note type="text" maxlength="2000" autocomplete="off";
                span { (language.say("note_hint")) }
            }
            nav.history aria-label=(language.say("history")) {
                button type="button" data-do="previous" { (language.say("previous")) " " kbd data-key="previous" {} }
                ol #history {}
                button type="button" data-do="next" { (language.say("next")) " " kbd data-key="next" {} }
                button type="button" data-do="jump" { (language.say("jump")) " " kbd data-key="jump" {} }
                button type="button" data-do="info" { (language.say("info")) " " kbd data-key="info" {} }
            }
        }
    }
}

fn verdict(action: &'static str, sign: &str, language: Language) -> Markup {
    html! {
        button.verdict type="button" data-do=(action) {
            span aria-hidden="true" { (sign) } " " (language.say(action)) " " kbd data-key=(action) {}
        }
    }
}

fn help(language: Language, tests_the_reviewer: bool) -> Markup {
    let list = |actions: &[&'static str]| {
        html! {
            dl {
                @for action in actions {
                    div { dt { kbd data-key=(action) {} } dd { (language.say(action)) } }
                }
            }
        }
    };
    let groups = [
        ("verdicts", &super::keys::ACTIONS[..11]),
        ("looking", &super::keys::ACTIONS[11..28]),
        ("going", &super::keys::ACTIONS[28..33]),
        ("by_hand", &super::keys::ACTIONS[33..39]),
    ];
    html! {
        dialog #help aria-labelledby="help-title" {
            form.title method="dialog" {
                h2 #help-title { (language.say("help")) }
                button { (language.say("close")) }
            }
            div.groups {
                @for (name, actions) in groups {
                    section { h3 { (Language::say(language, name)) } (list(actions)) }
                }
            }
            p { (language.say("by_hand")) ": " (language.say("correct_hint")) }
            @if tests_the_reviewer { p { (language.say("tested")) } }
        }
    }
}

fn jump(language: Language) -> Markup {
    html! {
        dialog #jump aria-labelledby="jump-title" {
            h2 #jump-title { (language.say("jump")) }
            form method="dialog" {
                label for="jump-to" { (language.say("jump_hint")) }
                input #jump-to type="text" list="pairs" autocomplete="off";
                datalist #pairs {}
                p #jump-error role="alert" {}
                button value="go" { (language.say("next")) }
                button value="" formnovalidate { (language.say("close")) }
            }
        }
    }
}
