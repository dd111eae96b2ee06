//! An item of the queue: an image that a reviewer judges, and related data that stay on the server.

use mocban_catalog::Shown;
use mocban_core::domain::{Affine2, AttentionCheck, ContentHash, PairName, ThresholdMetric};

/// What the images of an item are rendered from.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ItemView {
    /// Content hash of the print.
    pub(super) print_hash: ContentHash,
    /// Result hash of the depth stage.
    pub(super) depth_hash: ContentHash,
    /// Width and height of the depth map in pixels.
    pub(super) depth_px: [u32; 2],
    /// Threshold: depth-map levels at or above it are stroke.
    pub(super) level: u16,
    /// Depth-map pixels to print pixels.
    pub(super) print_from_depth: Affine2,
}

impl ItemView {
    /// Returns the hash of everything that the images are rendered from. A verdict is stored together with this hash.
    pub(super) fn hash(&self) -> ContentHash {
        let mut bytes = Vec::with_capacity(128);
        bytes.extend(self.print_hash.as_bytes());
        bytes.extend(self.depth_hash.as_bytes());
        bytes.extend(self.level.to_le_bytes());
        for number in self.print_from_depth.0.as_flattened() {
            bytes.extend(number.to_le_bytes());
        }
        ContentHash::of(&bytes)
    }

    /// Returns this view with the relief rotated clockwise about its centre by `angle_deg` degrees.
    pub(super) fn rotated(&self, angle_deg: f64) -> Self {
        let centre = self.depth_px.map(|side| (f64::from(side) - 1.0) / 2.0);
        let [x, y] = self.print_from_depth.apply(centre);
        let from_centre = Affine2::scale_shift(1.0, [-x, -y]);
        let rotation = Affine2::similarity(1.0, angle_deg.to_radians(), [x, y]).after(&from_centre);
        Self {
            print_from_depth: rotation.after(&self.print_from_depth),
            ..self.clone()
        }
    }

    /// Returns this view with the relief mirrored, left and right swapped.
    pub(super) fn mirrored(&self) -> Self {
        let flip = Affine2::mirror(self.depth_px[0]);
        Self {
            print_from_depth: self.print_from_depth.after(&flip),
            ..self.clone()
        }
    }
}

/// One image to judge.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ReviewItem {
    /// Opaque id used by the page. It reveals nothing about the item.
    pub(super) id: String,
    /// The pair.
    pub(super) pair: PairName,
    /// The results that look like this item, of one or several metrics.
    pub(super) results: Vec<(ThresholdMetric, ContentHash)>,
    /// Set if the item is an attention check.
    pub(super) check: Option<AttentionCheck>,
    /// What its images are rendered from.
    pub(super) view: ItemView,
    /// Sort key of the order by least confidence. Higher is less certain.
    pub(super) uncertainty: f64,
    /// Whether the result is good enough to plant a fault in it.
    pub(super) is_reliable: bool,
}

impl ReviewItem {
    /// Returns the subject of an answer to this item: the results or the attention check.
    pub(super) fn shown(&self) -> Shown {
        match (self.check, self.results.first()) {
            (Some(check), Some((metric, result_hash))) => Shown::Check {
                check,
                metric: *metric,
                result_hash: *result_hash,
            },
            _ => Shown::Results(self.results.clone()),
        }
    }

    /// Sets the id, which is derived from the secret `key`.
    pub(super) fn with_id(mut self, key: &ContentHash, reviewer: &str) -> Self {
        let kind = self.check.map_or("", |check| check.name());
        let view = self.view.hash();
        let parts: [&[u8]; 5] = [
            key.as_bytes(),
            view.as_bytes(),
            kind.as_bytes(),
            self.pair.as_str().as_bytes(),
            reviewer.as_bytes(),
        ];
        let mut id = ContentHash::of(&parts.join(&0)).to_hex();
        id.truncate(24);
        self.id = id;
        self
    }
}

#[cfg(test)]
pub(super) mod test_fixtures {
    use super::{ItemView, ReviewItem};
    use mocban_core::domain::{Affine2, ContentHash, PairName, ThresholdMetric};

    /// Returns a good result of one metric; items differ by their number.
    pub(crate) fn item(number: u16) -> ReviewItem {
        let name = format!("p{number}");
        ReviewItem {
            id: String::new(),
            results: vec![(ThresholdMetric::Density, ContentHash::of(name.as_bytes()))],
            pair: PairName::new(&name).expect("an id"),
            check: None,
            view: ItemView {
                print_hash: ContentHash::of(b"print"),
                depth_hash: ContentHash::of(&number.to_le_bytes()),
                depth_px: [101, 51],
                level: 700,
                print_from_depth: Affine2::similarity(0.5, 0.2, [3.0, 4.0]),
            },
            uncertainty: 0.0,
            is_reliable: true,
        }
        .with_id(&ContentHash::of(b"key"), "ana")
    }
}

#[cfg(test)]
mod tests {
    use super::test_fixtures::item;
    use mocban_core::domain::{AttentionCheck, ContentHash};

    #[test]
    fn a_rotated_relief_keeps_its_centre() {
        let view = item(1).view;
        let rotated = view.rotated(9.0);
        let [a, b] = [&view, &rotated].map(|view| view.print_from_depth.apply([50.0, 25.0]));
        assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9);
        let angle = rotated.print_from_depth.angle_deg() - view.print_from_depth.angle_deg();
        assert!((angle - 9.0).abs() < 1e-9);
    }

    #[test]
    fn a_mirrored_relief_keeps_its_position() {
        let view = item(1).view;
        let mirrored = view.mirrored();
        assert!(mirrored.print_from_depth.determinant() < 0.0);
        let left = view.print_from_depth.apply([0.0, 7.0]);
        let right = mirrored.print_from_depth.apply([100.0, 7.0]);
        assert!((left[0] - right[0]).hypot(left[1] - right[1]) < 1e-9);
    }

    #[test]
    fn ids_differ_by_view_kind_and_reviewer_and_are_opaque() {
        let key = ContentHash::of(b"key");
        let plain = item(1);
        let mut duplicate = plain.clone();
        duplicate.check = Some(AttentionCheck::Duplicate);
        let ids = [
            plain.clone().with_id(&key, "ana").id,
            plain.clone().with_id(&key, "bo").id,
            plain.with_id(&ContentHash::of(b"another"), "ana").id,
            duplicate.with_id(&key, "ana").id,
        ];
        for (i, id) in ids.iter().enumerate() {
            assert_eq!(id.len(), 24);
            assert!(id.bytes().all(|byte| byte.is_ascii_hexdigit()));
            assert!(!ids[..i].contains(id));
        }
    }
}
