//! The images of the page, as many as fit.

use base64::prelude::{BASE64_STANDARD, Engine as _};
use maud::{Markup, PreEscaped, html};

use mocban_results::gallery::{Gallery, GalleryGroup, GalleryItem, GalleryReason};
use mocban_results::number_format::format_count;

/// Descriptions of the three images of a result.
const LAYERS: [&str; 3] = [
    "print",
    "relief aligned to the print",
    "edges of the relief's strokes over the print",
];

/// Results of a group that are shown before the reader opens the others, so that the tables are not far below.
const OPEN_ITEMS: usize = 6;

/// The images on the page.
pub(super) struct Album<'a> {
    gallery: &'a Gallery,
    /// For each group of the gallery, the figures that fit.
    figures: Vec<Vec<String>>,
}

impl<'a> Album<'a> {
    /// Chooses the results whose images and captions fit into `max_bytes` in any language, taking one result from each group
    /// in turn.
    pub(super) fn new(gallery: &'a Gallery, max_bytes: usize) -> Self {
        let mut figures = vec![Vec::new(); gallery.groups.len()];
        let mut left = max_bytes;
        let longest = gallery.groups.iter().map(|group| group.items.len()).max();
        for round in 0..longest.unwrap_or(0) {
            for (shown, group) in figures.iter_mut().zip(&gallery.groups) {
                let Some(item) = group.items.get(round).filter(|item| size(item) <= left) else {
                    continue;
                };
                let figure = figure(item).into_string();
                if let Some(rest) = left.checked_sub(translated_size(item, figure.len())) {
                    left = rest;
                    shown.push(figure);
                }
            }
        }
        Self { gallery, figures }
    }

    /// Returns all groups with their introductions, or `None` without groups.
    pub(super) fn body(&self) -> Option<Markup> {
        let groups = self.gallery.groups.iter().zip(&self.figures);
        (!self.figures.is_empty()).then(|| html! {
            p { "Each result has three images. The first is the print, and the second the aligned relief, lit from the \
                side. The third is the print with the edges of the relief's strokes in orange. Results that look the same for several methods are shown once." }
            @for (group, figures) in groups { (self.group(group, figures)) }
        })
    }

    fn group(&self, group: &GalleryGroup, figures: &[String]) -> Markup {
        let (id, title, introduction) = texts(group.reason);
        let (first, rest) = figures.split_at(figures.len().min(OPEN_ITEMS));
        html! {
            h3 id={ "images-" (id) } { (title) }
            p {
                (introduction) " " (figures.len()) " of " (format_count(group.total)) " are shown"
                @if group.reason == GalleryReason::Random { ", chosen at random with seed " (self.gallery.seed) }
                "."
            }
            (items(first))
            @if !rest.is_empty() {
                details { summary { (format_count(rest.len() as u64)) " more" } (items(rest)) }
            }
        }
    }
}

fn items(figures: &[String]) -> Markup {
    html! { ul.items { @for figure in figures { li { (PreEscaped(figure)) } } } }
}

/// Returns three texts on a group: its name in URL fragments, its title and its introduction.
const fn texts(reason: GalleryReason) -> (&'static str, &'static str, &'static str) {
    match reason {
        GalleryReason::Failed => (
            "failed",
            "Failed by reviewers",
            "Results that reviewers failed, by name.",
        ),
        GalleryReason::Conflict => (
            "conflict",
            "Reviewers disagree",
            "Results that one reviewer passed and another failed, and that nobody has adjudicated.",
        ),
        GalleryReason::OffTruth => (
            "off-truth",
            "Off the ground truth",
            "Results that miss the true alignment or the true stroke tops.",
        ),
        GalleryReason::LowConfidence => (
            "low-confidence",
            "Low confidence",
            "Results of the ensemble with a confidence below 0.5, the lowest first.",
        ),
        GalleryReason::Random => (
            "random",
            "Random sample",
            "Results of the ensemble, independent of any verdict.",
        ),
    }
}

/// Returns the size in bytes of a result's images as base64.
fn size(item: &GalleryItem) -> usize {
    let images = item.images.iter().flatten();
    images.map(|image| image.len().div_ceil(3) * 4).sum()
}

/// Returns the most bytes that a figure with this length has in another language, with its list item. Its texts are up to half
/// as long again.
fn translated_size(item: &GalleryItem, len: usize) -> usize {
    const ITEM: usize = "<li></li>".len();
    let texts = len.saturating_sub(size(item));
    len.saturating_add(texts / 2).saturating_add(ITEM)
}

fn figure(item: &GalleryItem) -> Markup {
    let methods: Vec<&str> = item.metrics.iter().map(|metric| metric.title()).collect();
    let [mesh, print] = &item.files;
    html! {
        figure class="item" {
            div.three {
                @for (bytes, layer) in item.images.iter().zip(LAYERS) { (image(item, bytes.as_deref(), layer)) }
            }
            figcaption {
                strong { (item.pair) } @if let Some(character) = &item.character { " " span.character title=(code_points(character)) { (character) } }
                span.methods { (methods.join(", ")) }
                @if !item.numbers.is_empty() { span { (item.numbers) } }
                @for verdict in &item.verdicts { span.verdict { (verdict) } }
                @if let Some(problem) = &item.problem { span.verdict { "not drawn: " (problem) } }
                span.files { (mesh) " · " (print) }
            }
        }
    }
}

/// Returns the code points of a character, such as `U+20041`, for readers whose fonts lack the character.
fn code_points(character: &str) -> String {
    let points = character.chars().map(|c| format!("U+{:04X}", u32::from(c)));
    points.collect::<Vec<_>>().join(" ")
}

fn image(item: &GalleryItem, bytes: Option<&[u8]>, layer: &str) -> Markup {
    let alt = format!("{}: {layer}", item.pair);
    let Some(bytes) = bytes else {
        return html! { span.missing { "no image" } };
    };
    let source = format!("data:image/jpeg;base64,{}", BASE64_STANDARD.encode(bytes));
    html! { img alt=(alt) src=(source); }
}
