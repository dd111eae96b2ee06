//! Boxes with names on the image of a page, and a legend above an image.

use super::font::{cut_in_middle, line_height, text_width, write};
use super::paint::{BACKGROUND, Rgb, TEXT, copy, fill};

/// Space around the parts of a legend, pixels.
const GAP: usize = 10;
/// Size of the font of a legend in relation to the width of its picture, and its limits, pixels.
const FONT_SHARE: f32 = 0.0085;
const LEGEND_FONTS: [f32; 2] = [14.0, 34.0];
/// Sizes of the font of a name, pixels: the first one at which it fits into its box.
const NAME_FONTS: [f32; 5] = [17.0, 15.0, 13.0, 12.0, 11.0];
/// Width of the outline of a box, pixels.
const OUTLINE: usize = 3;
/// Fraction of the page that is left under a name, of 4.
const UNDER_NAME: u16 = 1;

/// A box on a picture of a page.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct MarkedBox {
    /// Edges in pixels of the picture: left, top, right, bottom.
    pub bounds: [f64; 4],
    /// Texts at its upper left corner. The first one that fits is written; the last one is shortened.
    pub names: Vec<String>,
    /// Colour of the outline.
    pub outline: [u8; 3],
    /// Colour behind the name.
    pub tag: [u8; 3],
}

/// A colour and what it stands for.
pub(crate) type LegendEntry = ([u8; 3], &'static str);

/// The texts above a picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PictureLegend {
    /// What the picture shows.
    pub title: String,
    /// Its colours.
    pub entries: Vec<LegendEntry>,
}

/// Draws boxes, given by their edges in pixels, without names.
pub(crate) fn mark_edges(picture: &mut Rgb, boxes: &[[f64; 4]], colour: [u8; 3]) {
    for bounds in boxes {
        let one = MarkedBox {
            bounds: *bounds,
            names: Vec::new(),
            outline: colour,
            tag: colour,
        };
        outline(picture, &one);
    }
}

/// Draws boxes and their names. Outlines are drawn first, so that none hides a name.
pub(crate) fn mark(picture: &mut Rgb, boxes: &[MarkedBox]) {
    for one in boxes {
        outline(picture, one);
    }
    for (index, one) in boxes.iter().enumerate() {
        let others = boxes
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != index);
        let others: Vec<[f64; 4]> = others.map(|(_, other)| other.bounds).collect();
        name(picture, one, &others);
    }
}

/// Returns the corner and the size of a box in whole pixels, or `None` if it lies beside the picture.
fn pixels(picture: &Rgb, [left, top, right, bottom]: [f64; 4]) -> Option<([usize; 2], [usize; 2])> {
    let clamped = |at: f64, count: usize| at.round().clamp(0.0, count as f64) as usize;
    let corner = [
        clamped(left, picture.width()),
        clamped(top, picture.height()),
    ];
    let end = [
        clamped(right, picture.width()),
        clamped(bottom, picture.height()),
    ];
    let size = [0, 1].map(|k: usize| end[k].saturating_sub(corner[k]));
    (size[0] > 0 && size[1] > 0).then_some((corner, size))
}

fn outline(picture: &mut Rgb, one: &MarkedBox) {
    let Some(([x, y], [width, height])) = pixels(picture, one.bounds) else {
        return;
    };
    let (right, bottom) = (
        x + width.saturating_sub(OUTLINE),
        y + height.saturating_sub(OUTLINE),
    );
    fill(picture, [x, y], [width, OUTLINE], one.outline);
    fill(picture, [x, bottom], [width, OUTLINE], one.outline);
    fill(picture, [x, y], [OUTLINE, height], one.outline);
    fill(picture, [right, y], [OUTLINE, height], one.outline);
}

/// Writes the name of a box above it, or within it if there is no space above.
fn name(picture: &mut Rgb, one: &MarkedBox, others: &[[f64; 4]]) {
    let Some(([x, y], [width, _])) = pixels(picture, one.bounds) else {
        return;
    };
    let space = width.saturating_sub(2 * OUTLINE + 2);
    let Some((text, size)) = fitting_name(&one.names, space) else {
        return;
    };
    let tag = [text_width(&text, size) + 2, line_height(size)];
    let end = x as f64 + tag[0] as f64;
    let above = y as f64 - tag[1] as f64;
    let is_free = |other: &[f64; 4]| {
        let [left, top, right, bottom] = *other;
        right <= x as f64 || left >= end || bottom <= above || top >= y as f64
    };
    let at = if above >= 0.0 && others.iter().all(is_free) {
        [x, y - tag[1]]
    } else {
        [x + OUTLINE, y + OUTLINE]
    };
    tint(picture, at, tag, one.tag);
    write(picture, &text, [at[0] + 1, at[1]], size, TEXT);
}

/// Returns the first name that fits into a width in pixels at any size, and the size; the last one is shortened. Returns
/// `None` if there are no names.
fn fitting_name(names: &[String], space: usize) -> Option<(String, f32)> {
    let fitting = names
        .iter()
        .flat_map(|text| NAME_FONTS.map(|size| (text, size)))
        .into_iter()
        .find(|(text, size)| text_width(text, *size) <= space);
    if let Some((text, size)) = fitting {
        return Some((text.clone(), size));
    }
    let smallest = NAME_FONTS[NAME_FONTS.len() - 1];
    let last = names.last()?;
    Some((cut_in_middle(last, space, smallest), smallest))
}

/// Mixes a colour into a rectangle, clipped.
fn tint(picture: &mut Rgb, at: [usize; 2], size: [usize; 2], colour: [u8; 3]) {
    for y in at[1]..(at[1] + size[1]).min(picture.height()) {
        for x in at[0]..(at[0] + size[0]).min(picture.width()) {
            let below = picture.at(x, y);
            let mixed = |k: usize| {
                let sum =
                    UNDER_NAME * u16::from(below[k]) + (4 - UNDER_NAME) * u16::from(colour[k]);
                (sum / 4) as u8
            };
            picture.set(x, y, [0, 1, 2].map(mixed));
        }
    }
}

/// Returns a picture below a legend. The entries of the legend continue on more lines if the picture is narrow.
pub(crate) fn with_legend(picture: &Rgb, legend: &PictureLegend) -> Rgb {
    let [smallest, largest] = LEGEND_FONTS;
    let size = (FONT_SHARE * picture.width() as f32).clamp(smallest, largest);
    let (line, width) = (line_height(size), picture.width().max(1));
    // The parts in order, each with its place: columns from the left, lines from the top.
    let (mut places, mut x, mut row) = (Vec::new(), GAP, 0);
    let title = text_width(&legend.title, size);
    let entry = |text: &str| line + text_width(text, size);
    let widths = std::iter::once(title).chain(legend.entries.iter().map(|(_, text)| entry(text)));
    for part in widths {
        if x > GAP && x + part + GAP > width {
            (x, row) = (GAP, row + 1);
        }
        places.push([x, GAP + row * line]);
        x += part + 3 * GAP;
    }
    let top = 2 * GAP + (row + 1) * line;
    let mut sheet = Rgb::new(width, top + picture.height(), BACKGROUND);
    write(&mut sheet, &legend.title, places[0], size, TEXT);
    for ((colour, text), [x, y]) in legend.entries.iter().zip(&places[1..]) {
        let side = line / 2;
        fill(&mut sheet, [*x, y + side / 2], [side, side], *colour);
        write(&mut sheet, text, [x + side + GAP / 2, *y], size, TEXT);
    }
    copy(&mut sheet, picture, 0, top);
    sheet
}

#[cfg(test)]
mod tests {
    use super::{MarkedBox, PictureLegend, mark, with_legend};
    use crate::pictures::{BLUE, Rgb, VERMILLION};

    fn marked(bounds: [f64; 4], names: &[&str]) -> Rgb {
        let mut picture = Rgb::new(200, 120, [255; 3]);
        let one = MarkedBox {
            bounds,
            names: names.iter().map(|name| (*name).to_owned()).collect(),
            outline: BLUE,
            tag: [255; 3],
        };
        mark(&mut picture, &[one]);
        picture
    }

    fn dark(picture: &Rgb) -> usize {
        let dark = |colour: &&[u8; 3]| colour.iter().all(|value| *value < 110);
        picture.data().iter().filter(dark).count()
    }

    #[test]
    fn a_box_has_an_outline_and_the_longest_name_that_fits() {
        let wide = marked([10.0, 10.0, 190.0, 110.0], &["c01-r02 0.98", "c01-r02"]);
        assert_eq!((wide.at(10, 60), wide.at(189, 60)), (BLUE, BLUE));
        assert_eq!(wide.at(100, 60), [255; 3]);
        let short = marked([10.0, 10.0, 190.0, 110.0], &["c01-r02"]);
        assert!(dark(&wide) > dark(&short) + 40, "the confidence is written");
        let narrow = marked([10.0, 10.0, 70.0, 110.0], &["c01-r02 0.98", "c01-r02"]);
        assert!(dark(&narrow) > 40);
        let beyond = (70..200).flat_map(|x| (0..120).map(move |y| (x, y)));
        let narrow_only = beyond.filter(|(x, y)| narrow.at(*x, *y) != [255; 3]);
        assert_eq!(narrow_only.count(), 0, "nothing is written beside the box");
    }

    #[test]
    fn a_name_is_above_its_box_unless_another_box_is_there() {
        let name_within = |second: [f64; 4]| {
            let mut picture = Rgb::new(200, 200, [255; 3]);
            let boxes = [[20.0, 100.0, 180.0, 190.0], second].map(|bounds| MarkedBox {
                bounds,
                names: vec!["c01-r02".to_owned()],
                outline: BLUE,
                tag: [200, 255, 255],
            });
            mark(&mut picture, &boxes);
            picture.at(25, 105) == [213, 255, 255]
        };
        assert!(!name_within([20.0, 30.0, 180.0, 60.0]));
        assert!(name_within([20.0, 30.0, 180.0, 97.0]));
        assert!(name_within([20.0, 10.0, 180.0, 85.0]));
    }

    #[test]
    fn a_box_beside_the_picture_changes_nothing() {
        let picture = marked([300.0, 10.0, 340.0, 50.0], &["a"]);
        assert!(picture.data().iter().all(|colour| *colour == [255; 3]));
    }

    #[test]
    fn a_legend_continues_on_the_next_line() {
        let legend = PictureLegend {
            title: "notes-1".to_owned(),
            entries: vec![
                (BLUE, "done with confidence"),
                (VERMILLION, "failed, or left out"),
            ],
        };
        let top = |width: usize| with_legend(&Rgb::new(width, 50, [9; 3]), &legend).height() - 50;
        assert!(top(200) > top(900), "{} {}", top(200), top(900));
        let drawn = with_legend(&Rgb::new(200, 50, [9; 3]), &legend);
        assert_eq!(drawn.at(0, drawn.height() - 1), [9; 3]);
        for colour in [BLUE, VERMILLION] {
            assert!(drawn.data().iter().filter(|at| **at == colour).count() > 40);
        }
    }
}
