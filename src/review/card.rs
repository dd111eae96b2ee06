//! A card: one picture that a reviewer judges, and what is known of it on our side only.

use crate::catalog::Shown;
use crate::domain::{
    Affine2, AttentionCheck, ContentHash, DepthOutcome, PairName, ThresholdMetric,
};

/// What the picture of a card is made from.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct View {
    /// Content of the print.
    pub(super) print_hash: ContentHash,
    /// Result of the depth stage.
    pub(super) depth_hash: ContentHash,
    /// Size of the depth map in pixels.
    pub(super) depth_px: [u32; 2],
    /// Depth-map levels from this one up are stroke.
    pub(super) level: u16,
    /// Depth-map pixels to print pixels.
    pub(super) print_from_depth: Affine2,
}

impl View {
    /// Hash of all that the picture is made from: verdicts are bound to it.
    pub(super) fn seen(&self) -> ContentHash {
        let mut bytes = Vec::with_capacity(128);
        bytes.extend(self.print_hash.as_bytes());
        bytes.extend(self.depth_hash.as_bytes());
        bytes.extend(self.level.to_le_bytes());
        for number in self.print_from_depth.0.as_flattened() {
            bytes.extend(number.to_le_bytes());
        }
        ContentHash::of(&bytes)
    }

    /// Size of the depth map as a stage told it.
    pub(super) const fn size(outcome: &DepthOutcome) -> [u32; 2] {
        [outcome.width, outcome.height]
    }

    /// Where the centre of the depth map lies on the print.
    fn centre(&self) -> [f64; 2] {
        let [width, height] = self.depth_px.map(f64::from);
        let middle = [(width - 1.0) / 2.0, (height - 1.0) / 2.0];
        self.print_from_depth.apply(middle)
    }

    /// The same picture with the relief turned about its centre, degrees clockwise.
    pub(super) fn turned(&self, angle_deg: f64) -> Self {
        let [x, y] = self.centre();
        let there = Affine2::scale_shift(1.0, [x, y]);
        let back = Affine2::scale_shift(1.0, [-x, -y]);
        let turn = Affine2::similarity(1.0, angle_deg.to_radians(), [0.0; 2]);
        Self {
            print_from_depth: there
                .after(&turn)
                .after(&back)
                .after(&self.print_from_depth),
            ..self.clone()
        }
    }

    /// The same picture with the relief in mirror writing.
    pub(super) fn mirrored(&self) -> Self {
        let flip = Affine2::mirror(self.depth_px[0]);
        Self {
            print_from_depth: self.print_from_depth.after(&flip),
            ..self.clone()
        }
    }
}

/// One picture to judge.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Card {
    /// Its name in the page, which tells nothing.
    pub(super) id: String,
    /// The pair.
    pub(super) pair: PairName,
    /// The results that look like this, of one metric or of several.
    pub(super) results: Vec<(ThresholdMetric, ContentHash)>,
    /// What it is when it only tests the reviewer.
    pub(super) control: Option<AttentionCheck>,
    /// What its picture is made from.
    pub(super) view: View,
    /// How much speaks against the result, for the order by risk.
    pub(super) risk: f64,
    /// Whether it is good enough to make a fault from.
    pub(super) is_good: bool,
}

impl Card {
    /// What an answer to it is stored as.
    pub(super) fn shown(&self) -> Shown {
        match (self.control, self.results.first()) {
            (Some(check), Some((metric, result_hash))) => Shown::Check {
                check,
                metric: *metric,
                result_hash: *result_hash,
            },
            _ => Shown::Results(self.results.clone()),
        }
    }

    /// The name in the page: from a key that is told to nobody.
    pub(super) fn named(mut self, key: &ContentHash, reviewer: &str) -> Self {
        let kind = self.control.map_or("", |control| control.name());
        let seen = self.view.seen();
        let parts: [&[u8]; 5] = [
            key.as_bytes(),
            seen.as_bytes(),
            kind.as_bytes(),
            self.pair.as_str().as_bytes(),
            reviewer.as_bytes(),
        ];
        let mut name = ContentHash::of(&parts.join(&0)).to_hex();
        name.truncate(24);
        self.id = name;
        self
    }
}

#[cfg(test)]
pub(super) mod test_fixtures {
    use super::{Card, View};
    use crate::domain::{Affine2, ContentHash, PairName, ThresholdMetric};

    /// A good result of one metric; the number tells it from others.
    pub(crate) fn card(number: u16) -> Card {
        let name = format!("p{number}");
        Card {
            id: String::new(),
            results: vec![(ThresholdMetric::Density, ContentHash::of(name.as_bytes()))],
            pair: PairName::new(&name).expect("an id"),
            control: None,
            view: View {
                print_hash: ContentHash::of(b"print"),
                depth_hash: ContentHash::of(&number.to_le_bytes()),
                depth_px: [101, 51],
                level: 700,
                print_from_depth: Affine2::similarity(0.5, 0.2, [3.0, 4.0]),
            },
            risk: 0.0,
            is_good: true,
        }
        .named(&ContentHash::of(b"key"), "ana")
    }
}

#[cfg(test)]
mod tests {
    use super::test_fixtures::card;
    use crate::domain::{AttentionCheck, ContentHash};

    #[test]
    fn a_turned_relief_keeps_its_centre() {
        let view = card(1).view;
        let turned = view.turned(9.0);
        let [a, b] = [&view, &turned].map(|view| view.print_from_depth.apply([50.0, 25.0]));
        assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9);
        let turn = turned.print_from_depth.angle_deg() - view.print_from_depth.angle_deg();
        assert!((turn - 9.0).abs() < 1e-9);
    }

    #[test]
    fn a_mirrored_relief_stays_where_it_is() {
        let view = card(1).view;
        let mirrored = view.mirrored();
        assert!(mirrored.print_from_depth.determinant() < 0.0);
        let left = view.print_from_depth.apply([0.0, 7.0]);
        let right = mirrored.print_from_depth.apply([100.0, 7.0]);
        assert!((left[0] - right[0]).hypot(left[1] - right[1]) < 1e-9);
    }

    #[test]
    fn names_differ_by_what_is_shown_and_by_reviewer_and_tell_nothing() {
        let key = ContentHash::of(b"key");
        let plain = card(1);
        let mut repeat = plain.clone();
        repeat.control = Some(AttentionCheck::Duplicate);
        let names = [
            plain.clone().named(&key, "ana").id,
            plain.clone().named(&key, "bo").id,
            plain.named(&ContentHash::of(b"another"), "ana").id,
            repeat.named(&key, "ana").id,
        ];
        for (i, name) in names.iter().enumerate() {
            assert_eq!(name.len(), 24);
            assert!(name.bytes().all(|byte| byte.is_ascii_hexdigit()));
            assert!(!names[..i].contains(name));
        }
    }
}
