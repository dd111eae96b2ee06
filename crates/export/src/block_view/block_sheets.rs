//! The two pictures of a block: the page with the boxes of its characters, and relief and ink over each other.

use super::characters::{CharacterStatus, CharacterView, PositionConfidence};
use super::page_layers::{BOTH, INK_BESIDE, PageLayer, PageLayers};
use super::page_view::BlockView;
use crate::pictures::{
    BLUE, LegendEntry, MarkedBox, PictureLegend, Rgb, VERMILLION, mark, with_legend,
};
use mocban_results::number_format::NumberStyle::Percent;
use mocban_results::number_format::{counted, format_number};

/// Pixels per mm of the page with boxes. Names are then readable in boxes of 5 mm.
const BOXES_PX_PER_MM: f64 = 12.0;
/// Pixels per mm of relief and ink over each other. An error of half a millimetre is then 3 pixels wide.
const OVERLAY_PX_PER_MM: f64 = 6.0;
/// Maximum length of the longer side of a picture, pixels.
const MAX_SIDE: f64 = 6000.0;

impl BlockView {
    /// Draws the page with the boxes of the characters. The outline shows the result of the pair, and the colour behind the
    /// name how sure the position is.
    pub fn draw_boxes(&self) -> Rgb {
        let scale = scale(&self.layers, BOXES_PX_PER_MM);
        let whole = self.layers.whole();
        let mut picture = self
            .layers
            .draw(PageLayer::Page, whole, whole.scaled(scale));
        let boxes: Vec<MarkedBox> = self
            .block
            .characters
            .iter()
            .map(|one| marked(one, scale))
            .collect();
        mark(&mut picture, &boxes);
        with_legend(
            &picture,
            &boxes_legend(self.block.name.as_str(), &self.block.characters),
        )
    }

    /// Draws the relief and the ink of the whole page over each other.
    pub fn draw_overlay(&self) -> Rgb {
        let scale = scale(&self.layers, OVERLAY_PX_PER_MM);
        let whole = self.layers.whole();
        let picture = self
            .layers
            .draw(PageLayer::Overlay, whole, whole.scaled(scale));
        let share = format_number(100.0 * self.block.agreement, Percent);
        let legend = PictureLegend {
            title: format!("{}: {share} % of the places agree", self.block.name),
            entries: vec![
                (BOTH, "ink and stroke of the relief"),
                (VERMILLION, "stroke without ink"),
                (BLUE, "ink without stroke"),
                (INK_BESIDE, "ink beside the scanned face"),
            ],
        };
        with_legend(&picture, &legend)
    }
}

/// Returns the pixels of a picture per pixel of the page.
fn scale(layers: &PageLayers, px_per_mm: f64) -> f64 {
    let [width, height] = layers.size();
    let longest = MAX_SIDE / width.max(height) as f64;
    (px_per_mm / layers.px_per_mm()).min(longest)
}

/// Returns the box of a character on a picture.
fn marked(one: &CharacterView, scale: f64) -> MarkedBox {
    let label = match &one.character {
        Some(character) if *character != one.label => format!("{} {character}", one.label),
        _ => one.label.clone(),
    };
    let confidence = one.position_confidence;
    let with_confidence = confidence.map(|value| format!("{label} {value:.2}"));
    MarkedBox {
        bounds: one.bounds.map(|edge| edge * scale),
        names: with_confidence
            .into_iter()
            .chain([label, one.label.clone()])
            .collect(),
        outline: one.status.colour(),
        tag: PositionConfidence::of(confidence).colour(),
    }
}

/// Returns the legend of the page with boxes. Colours that no box has are left out, except that of finished pairs.
fn boxes_legend(block: &str, characters: &[CharacterView]) -> PictureLegend {
    let has_status = |status: &CharacterStatus| {
        *status == CharacterStatus::Done || characters.iter().any(|one| one.status == *status)
    };
    let position = |one: &CharacterView| PositionConfidence::of(one.position_confidence);
    let has_position = |class: &PositionConfidence| {
        *class == PositionConfidence::Sure || characters.iter().any(|one| position(one) == *class)
    };
    let outlines = CharacterStatus::ALL.into_iter().filter(has_status);
    let tags = PositionConfidence::ALL.into_iter().filter(has_position);
    let outlines = outlines.map(|status| (status.colour(), status.title()));
    let entries: Vec<LegendEntry> = outlines
        .chain(tags.map(|class| (class.colour(), class.title())))
        .collect();
    let number = counted(characters.len() as u64, "character");
    PictureLegend {
        title: format!("{block}: {number}; outline: result of the pair, behind the name: position"),
        entries,
    }
}

#[cfg(test)]
mod tests {
    use super::{boxes_legend, marked, scale};
    use crate::block_view::characters::tests::stored;
    use crate::block_view::page_layers::tests::ridges;
    use crate::block_view::{CharacterStatus, CharacterView};
    use mocban_core::domain::BlockCharacterState;
    use mocban_results::test_fixtures;

    fn characters() -> Vec<CharacterView> {
        let done = test_fixtures::with_confidence("b_c1", 0.9);
        let bounds = [10.0, 20.0, 110.0, 140.0];
        let one = stored("c1", bounds, BlockCharacterState::Cut);
        let mut left = stored("c2", bounds, BlockCharacterState::Left);
        left.confidence = Some(0.3);
        vec![
            CharacterView::new(&one, Some(&done), None),
            CharacterView::new(&left, None, None),
        ]
    }

    #[test]
    fn boxes_are_scaled_and_have_the_colours_of_their_results() {
        let [done, left] = [0, 1].map(|k: usize| marked(&characters()[k], 0.5));
        assert_eq!(done.bounds, [5.0, 10.0, 55.0, 70.0]);
        assert_eq!(done.names, ["c1 明 0.91", "c1 明", "c1"]);
        assert_eq!(done.outline, CharacterStatus::Done.colour());
        assert_eq!(left.outline, CharacterStatus::Failed.colour());
        assert_ne!(done.tag, left.tag);
    }

    #[test]
    fn the_legend_names_the_colours_that_occur() {
        let legend = boxes_legend("b", &characters());
        assert!(
            legend.title.starts_with("b: 2 characters"),
            "{}",
            legend.title
        );
        let titles: Vec<_> = legend.entries.iter().map(|(_, title)| *title).collect();
        let expected = [
            "pair done",
            "pair failed, or not cut",
            "position sure (0.8 to 1)",
            "doubtful (below 0.5)",
        ];
        assert_eq!(titles, expected);
    }

    #[test]
    fn pictures_have_their_resolution_unless_they_would_be_too_large() {
        let layers = ridges();
        assert!((scale(&layers, 12.0) - 1.2).abs() < 1e-9);
        assert!(
            (scale(&layers, 1000.0) - 6.0).abs() < 1e-9,
            "6000 px of 1000"
        );
    }
}
