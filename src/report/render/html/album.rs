//! The pictures of the page, as many as there is room for.

use base64::prelude::{BASE64_STANDARD, Engine as _};
use maud::{Markup, PreEscaped, html};

use crate::report::gallery::{Gallery, GalleryItem, GalleryReason};

/// What the three pictures of a shot are, for who cannot see them.
const LAYERS: [&str; 3] = [
    "print",
    "relief laid on the print",
    "edges of the relief's strokes over the print",
];

/// The groups that have something to show.
pub(super) struct Album {
    seed: u64,
    groups: Vec<AlbumGroup>,
}

struct AlbumGroup {
    kind: GalleryReason,
    of: u64,
    shots: Vec<String>,
}

impl Album {
    /// As many pictures as take at most `room` bytes, a kind having no more than the others while they all have some.
    pub(super) fn new(gallery: &Gallery, room: usize) -> Self {
        let page = |kind, of| AlbumGroup {
            kind,
            of,
            shots: Vec::new(),
        };
        let mut groups: Vec<AlbumGroup> = gallery
            .groups
            .iter()
            .map(|group| page(group.kind, group.of))
            .collect();
        let mut left = room;
        let longest = gallery.groups.iter().map(|group| group.shots.len()).max();
        for round in 0..longest.unwrap_or(0) {
            for (page, group) in groups.iter_mut().zip(&gallery.groups) {
                let Some(shot) = group.shots.get(round).filter(|shot| size(shot) <= left) else {
                    continue;
                };
                let drawn = figure(shot).into_string();
                if let Some(rest) = left.checked_sub(drawn.len()) {
                    left = rest;
                    page.shots.push(drawn);
                }
            }
        }
        Self {
            seed: gallery.seed,
            groups,
        }
    }

    /// Whether there is nothing to show.
    pub(super) const fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// All groups with what they are.
    pub(super) fn body(&self) -> Markup {
        html! {
            p { "Each result three times: the print, the relief laid on it in raking light, and the edges of the relief's \
                strokes over the print in orange. What looks the same under several methods is shown once." }
            @for page in &self.groups { (self.group(page)) }
        }
    }

    fn group(&self, page: &AlbumGroup) -> Markup {
        let (id, title, what) = words(page.kind);
        html! {
            h3 id={ "pictures-" (id) } { (title) }
            p {
                (what) " " (page.shots.len()) " of " (page.of) " are shown"
                @if page.kind == GalleryReason::Lot { ", drawn by lot with the seed " (self.seed) }
                "."
            }
            ul.shots { @for shot in &page.shots { li { (PreEscaped(shot)) } } }
        }
    }
}

/// Name in addresses, title and sentence of a kind.
const fn words(kind: GalleryReason) -> (&'static str, &'static str, &'static str) {
    match kind {
        GalleryReason::Failed => (
            "failed",
            "Failed by reviewers",
            "Results that reviewers failed, in the order of names.",
        ),
        GalleryReason::Conflict => (
            "conflict",
            "Reviewers contradict each other",
            "Results that one passed and another failed, and nobody has settled.",
        ),
        GalleryReason::OffTruth => (
            "off-truth",
            "Off the truth",
            "Results that miss the true alignment or the true stroke tops.",
        ),
        GalleryReason::Lot => (
            "lot",
            "By lot",
            "Results of the ensemble, whatever was said of them.",
        ),
    }
}

/// Bytes that the pictures of a shot take at least.
fn size(shot: &GalleryItem) -> usize {
    let pictures = shot.pictures.iter().flatten();
    pictures.map(|picture| picture.len().div_ceil(3) * 4).sum()
}

fn figure(shot: &GalleryItem) -> Markup {
    let methods: Vec<&str> = shot.metrics.iter().map(|metric| metric.title()).collect();
    let [mesh, print] = &shot.files;
    html! {
        figure class="shot" {
            div.three {
                @for (picture, layer) in shot.pictures.iter().zip(LAYERS) { (image(shot, picture.as_deref(), layer)) }
            }
            figcaption {
                strong { (shot.pair) } @if let Some(character) = &shot.character { " " span.character title=(code_points(character)) { (character) } }
                span.methods { (methods.join(", ")) }
                @if !shot.numbers.is_empty() { span { (shot.numbers) } }
                @for said in &shot.said { span.said { (said) } }
                @if let Some(trouble) = &shot.trouble { span.said { "not drawn: " (trouble) } }
                span.files { (mesh) " · " (print) }
            }
        }
    }
}

/// A character by its numbers, such as `U+20041`, for who has no font with it.
fn code_points(character: &str) -> String {
    let points = character.chars().map(|c| format!("U+{:04X}", u32::from(c)));
    points.collect::<Vec<_>>().join(" ")
}

fn image(shot: &GalleryItem, picture: Option<&[u8]>, layer: &str) -> Markup {
    let alt = format!("{}: {layer}", shot.pair);
    let Some(bytes) = picture else {
        return html! { span.missing { "no picture" } };
    };
    let source = format!("data:image/jpeg;base64,{}", BASE64_STANDARD.encode(bytes));
    html! { img alt=(alt) src=(source); }
}
