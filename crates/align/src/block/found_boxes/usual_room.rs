//! The room that the characters of a page usually fill. Parts of strokes beyond it are pieces of rules and of the frame.

use super::places::{CharacterPlace, Strokes};
use super::stroke_parts::{Part, PlacedPart};

/// Quantile of the sizes of all characters that is the usual size, and the fewest sizes from which it is taken.
const USUAL: f64 = 0.65;
const MIN_SIZES: usize = 8;
/// Rows on both sides of a row that show where the middle of its column is.
const NEAR_ROWS: usize = 4;
/// How much smaller or larger than usual a character may be on each side, in pitches of columns.
const MARGIN: f64 = 0.08;
/// Largest thickness of a piece of a rule, in pitches of columns: its area divided by its longer side. For a piece with a corner,
/// this is about twice the thickness of the rule.
const THIN: f64 = 0.1;

/// Limits of the strokes of a place, pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct UsualRoom {
    /// Left and right edge.
    across: [f64; 2],
    /// Upper and lower edge for thin parts.
    along: [f64; 2],
    /// Largest area of a thin part for each pixel of its longer side.
    thin: f64,
}

impl UsualRoom {
    /// No limits.
    pub(super) const ANY: Self = Self {
        across: [f64::NEG_INFINITY, f64::INFINITY],
        along: [f64::NEG_INFINITY, f64::INFINITY],
        thin: 0.0,
    };

    /// Returns whether a position across lies within the edges.
    pub(super) fn holds(&self, x: usize) -> bool {
        let x = x as f64;
        x > self.across[0] && x < self.across[1]
    }

    /// Returns whether a part is no part of the character.
    pub(super) fn excludes(&self, part: &PlacedPart) -> bool {
        let [left, top, right, bottom] = part.edges();
        let is_beside = right <= self.across[0] || left >= self.across[1];
        let is_apart = bottom <= self.along[0] || top >= self.along[1];
        is_beside || (is_apart && part.is_thin(self.thin))
    }
}

/// Strokes of a row of a column: one character or two notes.
struct RowStrokes {
    column: usize,
    /// Numbers of the first place and of the one after the last.
    places: [usize; 2],
    /// Left and right edge.
    across: [f64; 2],
}

impl RowStrokes {
    fn width(&self) -> f64 {
        self.across[1] - self.across[0]
    }

    fn has_notes(&self) -> bool {
        self.places[1] > self.places[0] + 1
    }
}

/// Returns the usual room of each place. `pitch` is the distance of two columns, pixels.
pub(super) fn usual_rooms(
    places: &[CharacterPlace],
    strokes: &[Strokes],
    parts: &[PlacedPart],
    pitch: f64,
) -> Vec<UsualRoom> {
    let margin = MARGIN * pitch;
    let thin = THIN * pitch;
    let rows = rows_of(places, strokes);
    let widths = [false, true].map(|notes| {
        let of_kind = rows.iter().filter(|row| row.has_notes() == notes);
        usual(of_kind.map(RowStrokes::width))
    });
    let heights = [false, true].map(|notes| {
        let of_kind = (places.iter().zip(strokes))
            .filter(|(place, strokes)| place.half.is_some() == notes && strokes.area > 0);
        usual(of_kind.map(|(_, strokes)| strokes.bounds[3] - strokes.bounds[1]))
    });
    let bodies = bodies(places.len(), parts, thin);
    let mut rooms = vec![
        UsualRoom {
            thin,
            ..UsualRoom::ANY
        };
        places.len()
    ];
    for (number, row) in rows.iter().enumerate() {
        let kind = usize::from(row.has_notes());
        let (first, end) = (row.places[0], row.places[1]);
        if let (Some(width), Some(middle)) = (widths[kind], middle(&rows, number, &widths)) {
            let reach = width / 2.0 + margin;
            for room in &mut rooms[first..end] {
                room.across = [middle - reach, middle + reach];
            }
        }
        for ((room, place), body) in (rooms[first..end].iter_mut())
            .zip(&places[first..end])
            .zip(&bodies[first..end])
        {
            let height = heights[usize::from(place.half.is_some())];
            if let (Some(height), [top, bottom]) = (height, *body)
                && top < bottom
            {
                room.along = [bottom - height - margin, top + height + margin];
            }
        }
    }
    rooms
}

/// Returns the rows with strokes, column by column from the top.
fn rows_of(places: &[CharacterPlace], strokes: &[Strokes]) -> Vec<RowStrokes> {
    let mut rows: Vec<RowStrokes> = Vec::new();
    for (number, (place, strokes)) in places.iter().zip(strokes).enumerate() {
        let [left, _, right, _] = strokes.bounds;
        let is_of = |row: &&mut RowStrokes| {
            let first = &places[row.places[0]];
            (first.column, first.row) == (place.column, place.row)
        };
        if let Some(row) = rows.last_mut().filter(is_of) {
            row.places[1] = number + 1;
            row.across = [row.across[0].min(left), row.across[1].max(right)];
        } else {
            rows.push(RowStrokes {
                column: place.column,
                places: [number, number + 1],
                across: [left, right],
            });
        }
    }
    rows.retain(|row| row.across[0] < row.across[1]);
    rows
}

/// Returns the usual value; `None` for few values.
fn usual(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    if values.len() < MIN_SIZES {
        return None;
    }
    let at = (USUAL * values.len() as f64) as usize;
    Some(*values.select_nth_unstable_by(at, f64::total_cmp).1)
}

/// Returns the middle of a column at a row, from both edges of the rows around it, so that strokes beside the text on one
/// side do not move it.
fn middle(rows: &[RowStrokes], number: usize, widths: &[Option<f64>; 2]) -> Option<f64> {
    let near = number.saturating_sub(NEAR_ROWS)..(number + NEAR_ROWS + 1).min(rows.len());
    let mut middles = Vec::new();
    for row in &rows[near] {
        let width = widths[usize::from(row.has_notes())];
        if let Some(width) = width.filter(|_| row.column == rows[number].column) {
            middles.push(row.across[0] + width / 2.0);
            middles.push(row.across[1] - width / 2.0);
        }
    }
    middles.sort_by(f64::total_cmp);
    let half = middles.len() / 2;
    (half > 0).then(|| f64::midpoint(middles[half - 1], middles[half]))
}

/// Returns the upper and lower edge of the parts of each place that are not thin.
fn bodies(places: usize, parts: &[PlacedPart], thin: f64) -> Vec<[f64; 2]> {
    let mut bodies = vec![[f64::INFINITY, f64::NEG_INFINITY]; places];
    for part in parts {
        if let Part::Of(place) = part.place
            && !part.is_thin(thin)
        {
            let [_, top, _, bottom] = part.edges();
            bodies[place] = [bodies[place][0].min(top), bodies[place][1].max(bottom)];
        }
    }
    bodies
}

#[cfg(test)]
mod tests {
    use super::{UsualRoom, usual_rooms};
    use crate::block::found_boxes::places::{CharacterPlace, Strokes};
    use crate::block::found_boxes::stroke_parts::{Part, PlacedPart};

    const PITCH: f64 = 100.0;

    /// Returns the part of a place with a box of whole pixels, of which a fraction is inked.
    fn part(place: usize, bounds: [usize; 4], inked: f64) -> PlacedPart {
        let [left, top, right, bottom] = bounds;
        PlacedPart {
            place: Part::Of(place),
            bounds,
            area: (inked * ((right - left) * (bottom - top)) as f64) as usize,
        }
    }

    /// Returns the usual rooms of ten characters of 70 by 60 pixels in a column. Those for which `is_longer` is true have a
    /// stroke of 3 pixels beside them, 52 pixels from the middle of the column.
    fn rooms(is_longer: impl Fn(usize) -> bool) -> Vec<UsualRoom> {
        let places: Vec<CharacterPlace> = (0..10)
            .map(|row| CharacterPlace {
                column: 0,
                row,
                half: None,
                room: [0, 40 * row, 50, 40 * row + 40],
            })
            .collect();
        let strokes: Vec<Strokes> = (0..10)
            .map(|row| {
                let top = 80.0 * row as f64 + 9.5;
                let right = if is_longer(row) { 104.5 } else { 84.5 };
                Strokes {
                    area: 1_500,
                    bounds: [14.5, top, right, top + 60.0],
                    ..Strokes::EMPTY
                }
            })
            .collect();
        let parts: Vec<PlacedPart> = (0..10)
            .map(|row| part(row, [15, 80 * row + 10, 85, 80 * row + 70], 0.35))
            .collect();
        usual_rooms(&places, &strokes, &parts, PITCH)
    }

    #[test]
    fn strokes_beside_the_text_belong_to_no_character() {
        let rooms = rooms(|row| row < 3);
        for room in &rooms {
            let [left, right] = room.across;
            assert!((left - 6.5).abs() < 1.0, "{left}");
            assert!((right - 92.5).abs() < 1.0, "{right}");
        }
        assert!(rooms[1].excludes(&part(1, [102, 90, 105, 140], 1.0)));
        assert!(!rooms[1].excludes(&part(1, [82, 90, 105, 140], 1.0)));
    }

    #[test]
    fn thin_parts_far_above_or_below_a_character_belong_to_none() {
        let room = rooms(|_| false)[0];
        assert!(room.excludes(&part(0, [10, 79, 90, 82], 1.0)));
        assert!(room.excludes(&part(0, [10, 0, 90, 2], 1.0)));
        assert!(!room.excludes(&part(0, [10, 76, 90, 79], 1.0)));
        // A thick part may be a part of a character that is higher than others.
        assert!(!room.excludes(&part(0, [10, 79, 90, 95], 1.0)));
    }

    #[test]
    fn few_characters_say_nothing_of_the_usual_room() {
        let places = [CharacterPlace {
            column: 0,
            row: 0,
            half: None,
            room: [0, 0, 50, 40],
        }];
        let strokes = [Strokes {
            area: 1_500,
            bounds: [14.5, 9.5, 84.5, 69.5],
            ..Strokes::EMPTY
        }];
        let parts = [part(0, [15, 10, 85, 70], 0.35)];
        let room = usual_rooms(&places, &strokes, &parts, PITCH)[0];
        assert!(!room.excludes(&part(0, [200, 300, 203, 350], 1.0)));
    }
}
