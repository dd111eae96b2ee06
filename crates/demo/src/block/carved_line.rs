//! Carves rules and ornaments.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::face_field::{FAR_MM, FaceField};
use super::layout::FishTail;
use super::page_rule::PageRule;
use crate::noise::{Noise, smoothstep};
use crate::polygon::BoundsMm;

/// Adds a rule with a wavy course, an irregular width and a few gaps.
pub(super) fn add_rule(field: &mut FaceField, rule: &PageRule, rng: &mut ChaCha8Rng) {
    let [from, to] = rule.ends;
    let length = (to[0] - from[0]).hypot(to[1] - from[1]).max(1e-9);
    let along = [0, 1].map(|i| (to[i] - from[i]) / length);
    let (course, edge, worn) = (Noise::draw(rng), Noise::draw(rng), Noise::draw(rng));
    let wave_mm = rng.random_range(0.05..0.25);
    let gap_from = rng.random_range(0.65..1.0);
    let half = rule.half_width_mm;
    let reach = reach_of(from, to, half + 0.5);
    field.add_line(reach, |[u, v]| {
        let offset = [u - from[0], v - from[1]];
        let t = offset[0] * along[0] + offset[1] * along[1];
        let across = offset[1] * along[0] - offset[0] * along[1];
        let middle = wave_mm * course.at(t / 30.0, 0.0) + 0.04 * course.at(t / 1.8, 9.0);
        let width = half * (1.0 + 0.2 * edge.at(t / 6.0, 3.0)) + 0.03 * edge.at(t / 0.5, 7.0);
        let beyond = (-t).max(t - length) - half;
        let gap = (half + 0.3) * smoothstep(gap_from, gap_from + 0.08, worn.at(t / 9.0, 1.0));
        (width - (across - middle).abs()).min(-beyond) - gap
    });
}

/// Adds a fish tail.
pub(super) fn add_fish_tail(field: &mut FaceField, tail: &FishTail, rng: &mut ChaCha8Rng) {
    let edge = Noise::draw(rng);
    let [half_u, half_v] = tail.half_mm;
    let reach = reach_of(tail.centre, tail.centre, half_u.max(half_v));
    field.add_line(reach, |[u, v]| {
        let across = u - tail.centre[0];
        // Positive towards the notch.
        let down = (v - tail.centre[1]) * tail.notch;
        let rectangle = (half_u - across.abs()).min(half_v - down.abs());
        // The notch opens from the middle of the rectangle towards its corners.
        let notch = (across.abs() * half_v / half_u - down) * 0.7;
        rectangle.min(notch) + 0.05 * edge.two_octaves(u / 0.5, v / 0.5)
    });
}

/// Returns the box around two points within which a line with the given half width changes the field.
fn reach_of(a: [f64; 2], b: [f64; 2], half_width_mm: f64) -> BoundsMm {
    let margin = half_width_mm - FAR_MM;
    BoundsMm {
        min: [0, 1].map(|i| a[i].min(b[i]) - margin),
        max: [0, 1].map(|i| a[i].max(b[i]) + margin),
    }
}
