//! Recognizes scans of an unexpected size: a whole block that was given as one character, or a wrong unit. Compares what is
//! said of a scan with what was found.

use crate::stages::{ScanHints, StageError};
use mocban_core::domain::cancel::poll;
use mocban_core::domain::{DepthOutcome, FailureClass, FitOutcome, LengthUnit};
use mocban_core::mesh::Vertices;
use mocban_core::mesh::robust_bounds::{bulk_box, is_in_box};
use mocban_core::raster::DepthMap;

/// Lengths of whole blocks, mm. Characters have 6 to 30 mm.
const BLOCK_MM: std::ops::RangeInclusive<f64> = 120.0..=1_000.0;

/// Returns the advice for a scan that is as long as a whole block: a part of a sentence, or nothing for other scans.
///
/// `length` is in units of the mesh; an unknown unit counts as millimetres.
fn advice(length: f64, unit: Option<LengthUnit>) -> String {
    let length_mm = length * unit.map_or(1.0, LengthUnit::mm);
    if !BLOCK_MM.contains(&length_mm) {
        return String::new();
    }
    format!(
        "; this looks like a whole block ({length_mm:.0} mm): import it with its page by `mocban import --block`"
    )
}

/// Returns the advice for the error of a stage: on scans as long as a block if it found no solution, nothing otherwise.
pub fn advice_for(error: &StageError, length: f64, unit: Option<LengthUnit>) -> String {
    match error.class() {
        FailureClass::NoSolution => advice(length, unit),
        _ => String::new(),
    }
}

/// Lengths that a scan of a character or block can have, mm.
const POSSIBLE_MM: std::ops::RangeInclusive<f64> = 0.5..=10_000.0;

/// Lengths of most scans of characters, mm.
const CHARACTER_MM: std::ops::RangeInclusive<f64> = 5.0..=60.0;

/// Lengths of most scans of characters and blocks, mm.
const USUAL_MM: std::ops::RangeInclusive<f64> = 5.0..=1_000.0;

/// Returns why the unit of a scan must be wrong, or `None` if it may be right. `length` is in units of the mesh.
pub fn wrong_unit(length: f64, unit: Option<LengthUnit>) -> Option<String> {
    let unit = unit?;
    let length_mm = length * unit.mm();
    if length == 0.0 || POSSIBLE_MM.contains(&length_mm) {
        return None;
    }
    let shown = if length_mm > 1.0 {
        format!("{:.1} m", length_mm / 1000.0)
    } else {
        format!("{length_mm:.3} mm")
    };
    let first_in = |range: std::ops::RangeInclusive<f64>| {
        let mut units = LengthUnit::ALL.into_iter();
        units.find(|unit| range.contains(&(length * unit.mm())))
    };
    let likely = first_in(CHARACTER_MM).or_else(|| first_in(USUAL_MM));
    let likely = likely.map_or_else(String::new, |unit| format!(" (perhaps {unit})"));
    Some(format!(
        "with the unit {unit}, the scan is {shown} long; correct the unit{likely}"
    ))
}

/// Typical long side of a block, mm.
pub const TYPICAL_BLOCK_MM: f64 = 320.0;

/// Typical longer side of a character, mm.
pub const TYPICAL_CHARACTER_MM: f64 = 12.0;

/// Longer sides of characters that do not contradict the unit, mm.
const POSSIBLE_CHARACTER_MM: std::ops::RangeInclusive<f64> = 2.5..=40.0;

/// Returns the unit in which a length in units of the mesh is nearest to a typical one, mm.
pub fn nearest_unit(length: f64, typical_mm: f64) -> LengthUnit {
    let distance = |unit: &LengthUnit| (length * unit.mm() / typical_mm).ln().abs();
    LengthUnit::ALL
        .into_iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .unwrap_or(LengthUnit::Mm)
}

/// Returns why the face of a block cannot be one, if its longer side in mm is that of a character.
pub fn short_face(longest_mm: f64, unit: LengthUnit) -> String {
    let length = longest_mm / unit.mm();
    let likely = nearest_unit(length, TYPICAL_BLOCK_MM);
    let other = if likely == unit {
        String::new()
    } else {
        format!(" (with the unit {likely}: {:.0} mm)", length * likely.mm())
    };
    format!(
        "its face is only {longest_mm:.0} mm long, which is the size of a single character{other}"
    )
}

/// Returns a warning about the unit of a block whose characters are smaller than 2.5 mm or larger than 40 mm. `side_mm` is
/// the median of their longer sides, mm.
pub fn doubtful_characters(side_mm: f64, unit: LengthUnit) -> Option<String> {
    if side_mm.is_nan() || POSSIBLE_CHARACTER_MM.contains(&side_mm) {
        return None;
    }
    let question = question(side_mm, unit);
    Some(format!(
        "characters of about {side_mm:.1} mm, but most have 6 to 30 mm; {question}"
    ))
}

/// Asks for the unit in which a length has the size of a character.
fn question(length_mm: f64, unit: LengthUnit) -> String {
    let likely = nearest_unit(length_mm / unit.mm(), TYPICAL_CHARACTER_MM);
    if likely == unit {
        "check the unit".to_owned()
    } else {
        format!("is the unit {likely}?")
    }
}

/// Longer sides of the carved surface of one character, with the wood around it, that do not contradict the unit, mm.
const POSSIBLE_SURFACE_MM: std::ops::RangeInclusive<f64> = 2.0..=150.0;

/// Returns a warning about the unit of the scan of one character whose carved surface is less than 2 mm or more than 150 mm
/// across. `length` is the longer side of the surface in units of the mesh.
pub fn doubtful_surface(length: f64, unit: Option<LengthUnit>) -> Option<String> {
    let unit = unit?;
    let length_mm = length * unit.mm();
    if length_mm.is_nan() || POSSIBLE_SURFACE_MM.contains(&length_mm) {
        return None;
    }
    let is_small = length_mm < *POSSIBLE_SURFACE_MM.start();
    let decimals = if is_small { 2 } else { 0 };
    let question = question(length_mm, unit);
    // No unit makes a long scan that of a character.
    let advice = if is_small || question.ends_with('?') {
        ""
    } else {
        "; a whole block is imported with its page by `mocban import --block`"
    };
    Some(format!(
        "with the unit {unit}, its carved surface is {length_mm:.decimals$} mm across, but most characters have 6 to 30 mm; {question}{advice}"
    ))
}

/// Depths of carving that do not contradict the unit, mm.
const POSSIBLE_RELIEF_MM: std::ops::RangeInclusive<f64> = 0.01..=10.0;

/// Least share of the z axis of the mesh in the direction of the carved face from which the face points up or down.
const MIN_NORMAL_Z: f64 = 0.3;

/// Returns how the result of `fit` contradicts what was said of the scan, one sentence each.
pub fn contradictions(fit: &FitOutcome, hints: ScanHints) -> Vec<String> {
    let relief_mm = hints.unit.map(|unit| fit.relief * unit.mm());
    let relief = relief_mm.filter(|mm| !POSSIBLE_RELIEF_MM.contains(mm)).map(|mm| {
        format!(
            "its carving is {mm:.3} mm deep, but most blocks are carved 0.3 to 5 mm deep; if the unit is wrong, so are all lengths in mm"
        )
    });
    let up = fit.plane_from_mesh.0[2][2];
    let side = hints
        .scanned_face_down
        .filter(|face_down| *face_down != (up < 0.0) && up.abs() >= MIN_NORMAL_Z);
    let side = side.map(|face_down| {
        let [said, found] = if face_down { ["-z", "+z"] } else { ["+z", "-z"] };
        format!("scanned_face_down says that the carved face points towards {said}, but carving was found towards {found}")
    });
    relief.into_iter().chain(side).collect()
}

/// Vertices between two polls for a cancellation.
const VERTICES_PER_POLL: usize = 1 << 14;

/// Returns the longest side of the bounding box of vertices without distant specks, in units of the mesh.
pub fn length_of(vertices: &Vertices) -> f64 {
    match vertices {
        Vertices::Single(all) => longest_side(all),
        Vertices::Double(all) => longest_side(all),
    }
}

fn longest_side<T: Copy + Into<f64>>(vertices: &[[T; 3]]) -> f64 {
    let bulk = bulk_box(vertices);
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for part in vertices.chunks(VERTICES_PER_POLL) {
        poll();
        for vertex in part {
            let vertex = vertex.map(Into::into);
            let is_inside = is_in_box(&bulk, &vertex);
            for ([low, high], value) in bounds.iter_mut().zip(vertex) {
                // Ignores NaN: comparisons with it are false.
                *low = if is_inside && value < *low {
                    value
                } else {
                    *low
                };
                *high = if is_inside && value > *high {
                    value
                } else {
                    *high
                };
            }
        }
    }
    bounds
        .iter()
        .map(|[low, high]| high - low)
        .fold(0.0, f64::max)
}

/// Returns the longer side of a depth map, in units of the mesh.
pub fn length_of_map(depth: &DepthMap) -> f64 {
    let pixels = depth.levels.width().max(depth.levels.height());
    pixels as f64 * depth.scale.mesh_unit_per_px
}

/// Returns the longer side of a stored depth map, in units of the mesh.
pub fn length_of_outcome(depth: &DepthOutcome) -> f64 {
    f64::from(depth.width.max(depth.height)) * depth.scale.mesh_unit_per_px
}

#[cfg(test)]
mod tests {
    use super::{advice, doubtful_characters, doubtful_surface, length_of, short_face, wrong_unit};
    use crate::stages::depth::DepthError;
    use crate::stages::fit::FitError;
    use mocban_core::domain::{Failure, FailureClass, LengthUnit};
    use mocban_core::mesh::Vertices;

    #[test]
    fn only_scans_as_long_as_a_block_get_the_advice() {
        assert!(advice(345.0, None).contains("345 mm"));
        assert!(advice(12.6, Some(LengthUnit::In)).contains("320 mm"));
        for (length, unit) in [(12.0, None), (1.2, Some(LengthUnit::Cm)), (2_500.0, None)] {
            assert_eq!(advice(length, unit), "");
        }
    }

    #[test]
    fn impossible_lengths_are_those_of_a_wrong_unit() {
        assert_eq!(
            wrong_unit(12.54, Some(LengthUnit::M)).as_deref(),
            Some("with the unit m, the scan is 12.5 m long; correct the unit (perhaps mm)")
        );
        let text = wrong_unit(0.012, Some(LengthUnit::Mm)).expect("a grain of dust");
        assert!(
            text.contains("0.012 mm long") && text.contains("perhaps m)"),
            "{text}"
        );
        for (length, unit) in [
            (12.5, None),
            (12.5, Some(LengthUnit::Mm)),
            (0.0125, Some(LengthUnit::M)),
            (1.6, Some(LengthUnit::M)),
            (0.0, Some(LengthUnit::M)),
        ] {
            assert_eq!(wrong_unit(length, unit), None);
        }
    }

    #[test]
    fn failures_because_of_the_unit_have_a_clause_that_says_so() {
        let long = wrong_unit(12.5, Some(LengthUnit::M)).expect("12.5 m");
        let names_unit = |message: &str| Failure::new(FailureClass::BadInput, message).names_unit();
        for message in [
            long,
            FitError::TooLarge(3).to_string(),
            DepthError::UnitUnknown.to_string(),
            DepthError::TooLarge { longest_px: 1e6 }.to_string(),
        ] {
            assert!(names_unit(&message), "{message}");
        }
        for message in [
            FitError::OneLine(3).to_string(),
            DepthError::Overlap(3).to_string(),
            advice(345.0, Some(LengthUnit::In)),
        ] {
            assert!(!names_unit(&message), "{message}");
        }
    }

    #[test]
    fn the_likeliest_unit_gives_a_character() {
        let text = wrong_unit(0.484, Some(LengthUnit::Mm)).expect("half a millimetre");
        assert!(text.ends_with("(perhaps in)"), "{text}");
    }

    #[test]
    fn the_size_of_characters_says_whether_the_unit_is_wrong() {
        assert_eq!(doubtful_characters(f64::NAN, LengthUnit::Mm), None);
        for (side_mm, unit, likely) in [
            (0.9, LengthUnit::Mm, "is the unit cm?"),
            (150.0, LengthUnit::Cm, "is the unit mm?"),
            (0.4, LengthUnit::Mm, "is the unit in?"),
            (60.0, LengthUnit::In, "is the unit cm?"),
            (41.0, LengthUnit::Cm, "is the unit mm?"),
        ] {
            let expected =
                format!("characters of about {side_mm:.1} mm, but most have 6 to 30 mm; {likely}");
            assert_eq!(doubtful_characters(side_mm, unit), Some(expected));
        }
        for side_mm in [2.5, 12.0, 40.0] {
            assert_eq!(doubtful_characters(side_mm, LengthUnit::Mm), None);
        }
        let large = doubtful_characters(41.0, LengthUnit::Mm).expect("a doubt");
        assert!(large.ends_with("6 to 30 mm; check the unit"), "{large}");
    }

    #[test]
    fn a_surface_that_is_too_small_or_large_for_a_character_is_doubted() {
        for (length, unit, said) in [
            (
                0.5,
                LengthUnit::Mm,
                "0.50 mm across, but most characters have 6 to 30 mm; is the unit in?",
            ),
            (
                1.2,
                LengthUnit::Mm,
                "1.20 mm across, but most characters have 6 to 30 mm; is the unit cm?",
            ),
            (
                20.0,
                LengthUnit::In,
                "508 mm across, but most characters have 6 to 30 mm; is the unit mm?",
            ),
            (
                500.0,
                LengthUnit::Mm,
                "500 mm across, but most characters have 6 to 30 mm; check the unit",
            ),
        ] {
            let text = doubtful_surface(length, Some(unit)).expect("a doubt");
            let expected = format!("with the unit {unit}, its carved surface is {said}");
            assert!(text.starts_with(&expected), "{text}");
            assert_eq!(text.contains("--block"), length > 100.0, "{text}");
        }
        for length in [2.0, 8.0, 30.0, 100.0, 150.0, f64::NAN] {
            assert_eq!(doubtful_surface(length, Some(LengthUnit::Mm)), None);
        }
        assert_eq!(doubtful_surface(0.5, None), None);
    }

    #[test]
    fn a_face_as_long_as_a_character_has_its_length_in_the_likeliest_unit() {
        let single = "its face is only 32 mm long, which is the size of a single character";
        assert_eq!(
            short_face(32.0, LengthUnit::Mm),
            format!("{single} (with the unit cm: 320 mm)")
        );
        assert_eq!(short_face(32.0, LengthUnit::M), single);
    }

    #[test]
    fn the_length_is_the_longest_side_of_the_box() {
        let vertices = [[1.0, -4.0, 0.0], [3.0, 9.0, 2.0]].into_iter().collect();
        assert_eq!(length_of(&vertices), 13.0);
    }

    #[test]
    fn a_vertex_far_away_does_not_change_the_length() {
        let scan = |k: u32| [f64::from(k % 70), f64::from(k / 70), 0.0];
        let mut vertices: Vertices = (0..4_900).map(scan).collect();
        for far in [1e6, -1e30, f64::MAX] {
            vertices.set(2_000, [3.0, far, 0.0]);
            assert_eq!(length_of(&vertices), 69.0, "{far}");
        }
    }
}
