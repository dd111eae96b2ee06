//! Dialogs of the review page: the guide with its examples, the keys, the jump to a pair, and a confirmation.

use maud::{Markup, html};

use super::examples::{EXAMPLES, Example};
use super::i18n::Language;
use super::keys::ACTIONS;
use mocban_core::domain::Reason;

/// Returns the guide: when to pass, an example for each reason to fail, and the colours. It opens on a reviewer's first
/// start.
pub(super) fn guide(language: Language) -> Markup {
    html! {
        dialog #guide aria-labelledby="guide-title" {
            form.title method="dialog" {
                h2 #guide-title { (language.translate("guide")) }
                button { (language.translate("close")) }
            }
            p { (language.translate("guide_question")) }
            form.actions method="dialog" {
                button.verdict type="button" data-action="practice" autofocus { (language.translate("practice")) }
                button { (language.translate("start_judging")) }
            }
            ul.colours {
                li { i.swatch.relief-edge {} (language.translate("colour_edges")) }
                li { i.swatch.ink {} (language.translate("colour_ink")) }
                li { i.swatch.both {} (language.translate("colour_both")) }
            }
            div.examples {
                @for example in &EXAMPLES { (example_figure(example, language)) }
            }
        }
    }
}

fn example_figure(example: &Example, language: Language) -> Markup {
    let reason = example.reason.map(Reason::name);
    let verdict = example.verdict.name();
    html! {
        figure.example data-example=(example.name) {
            canvas role="img" aria-label=(language.translate(reason.unwrap_or(verdict))) {}
            figcaption {
                @match reason {
                    Some(reason) => {
                        b.fail { span aria-hidden="true" { "✗ " } (language.translate(reason)) }
                        " " kbd data-key=(reason) {}
                    }
                    None => {
                        b.pass { span aria-hidden="true" { "✓ " } (language.translate(verdict)) }
                        " " kbd data-key=(verdict) {}
                    }
                }
                span.why { (language.explanation(example.name)) }
            }
        }
    }
}

/// Returns the list of keys.
pub(super) fn help(language: Language, has_attention_checks: bool) -> Markup {
    html! {
        dialog #help aria-labelledby="help-title" {
            form.title method="dialog" {
                h2 #help-title { (language.translate("help")) }
                button { (language.translate("close")) }
            }
            div.groups {
                @for (name, actions) in ACTIONS {
                    section {
                        h3 { (language.translate(name)) }
                        dl {
                            @for action in actions.split_whitespace() {
                                div { dt { kbd data-key=(action) {} } dd { (language.translate(action)) } }
                            }
                        }
                    }
                }
            }
            p { (language.translate("manual_alignment")) ": " (language.translate("alignment_hint")) }
            @if has_attention_checks { p { (language.translate("attention_checks")) } }
        }
    }
}

/// Returns the field for the id of a pair.
pub(super) fn jump(language: Language) -> Markup {
    html! {
        dialog #jump aria-labelledby="jump-title" {
            h2 #jump-title { (language.translate("jump")) }
            form method="dialog" {
                label for="jump-to" { (language.translate("jump_hint")) }
                input #jump-to type="text" list="pairs" autocomplete="off";
                datalist #pairs {}
                p #jump-error role="alert" {}
                div.actions {
                    button value="go" { (language.translate("go")) }
                    button value="" formnovalidate { (language.translate("close")) }
                }
            }
        }
    }
}

/// Returns the question before an alignment is saved that is worse than the computed one.
pub(super) fn confirm(language: Language) -> Markup {
    html! {
        dialog #confirm aria-labelledby="confirm-text" {
            p #confirm-text {}
            form.actions method="dialog" {
                button value="" { (language.translate("go_on_aligning")) }
                button value="yes" { (language.translate("save_anyway")) }
            }
        }
    }
}
