//! Conditions of one pair, drawn from the ranges of its kind.

use rand_chacha::ChaCha8Rng;

use super::draw::{number_within, one_of, within};
use super::kind::{Base, Crop, DemoKind, NumberRange};
use super::noise::Noise;
use super::paper_geometry::PaperGeometry;
use super::slid_part::SlidPart;
use super::slow_errors::SlowErrors;
use super::weathering::Weathering;

/// Conditions of carving, scan, print and crop. The default applies to the tiers without a kind.
#[derive(Debug, Clone)]
pub(super) struct Conditions {
    /// Factor of the carved depth.
    pub depth: f64,
    /// Wear and dirt, if any.
    pub weathering: Option<Weathering>,
    /// Minimum and maximum fraction of the stroke area that is lost, if any is.
    pub lost: Option<NumberRange>,
    /// Errors of the scan.
    pub scan: ScanErrors,
    /// What the scan contains besides the carved face.
    pub base: Base,
    /// Thickness of the block as a fraction of the character's size.
    pub thickness: f64,
    /// Amount of ink. `None` if the tier's own rule applies.
    pub ink: Option<InkAmount>,
    /// Deformation of the sheet and position of the camera. `None` for an undeformed sheet that is not photographed at
    /// an angle.
    pub paper: Option<PaperGeometry>,
    /// Which of mesh and print shows all neighbours.
    pub crop: Crop,
    /// Height of neighbours and column rules above the character's tops, mm.
    pub raised_mm: f64,
    /// The part of the block that slid along a crack, if any did.
    pub slid: Option<SlidPart>,
}

/// Errors of a scan beyond those of every scan.
#[derive(Debug, Clone, Copy)]
pub(super) struct ScanErrors {
    /// Factor of the height noise.
    pub noise: f64,
    /// Amplitude of the smooth height error, mm.
    pub ripple_mm: f64,
    /// Standard deviation of the smoothing, mm.
    pub smoothing_mm: f64,
    /// Slow errors, if any.
    pub slow: Option<SlowErrors>,
    /// Number of large holes.
    pub holes: u32,
    /// Number of far outlier vertices.
    pub spikes: u32,
    /// Number of floating pieces.
    pub blobs: u32,
}

/// Amount of ink and its distribution.
#[derive(Debug, Clone, Copy)]
pub(super) struct InkAmount {
    /// Distance of the ink's edge from the edge of the printing surface, mm.
    pub spread_mm: f64,
    /// Ink density, 0..=1.
    pub strength: f64,
    /// Degree of dryness.
    pub dryness: f64,
    /// Largest fraction of missing ink.
    pub uneven: f64,
    /// Where the contact was poor.
    pub contact: Noise,
    /// Density of smeared ink.
    pub smear: f64,
    /// Where ink is smeared.
    pub smears: Noise,
}

impl Default for Conditions {
    /// Returns the conditions that change nothing.
    fn default() -> Self {
        Self {
            depth: 1.0,
            weathering: None,
            lost: None,
            scan: ScanErrors {
                noise: 1.0,
                ripple_mm: 0.0,
                smoothing_mm: 0.0,
                slow: None,
                holes: 0,
                spikes: 0,
                blobs: 0,
            },
            base: Base::Ordinary,
            thickness: 0.0,
            ink: None,
            paper: None,
            crop: Crop::Character,
            raised_mm: 0.0,
            slid: None,
        }
    }
}

impl Conditions {
    /// Draws the conditions of a kind. Without a kind, returns the default and draws no random numbers.
    pub(super) fn draw(kind: Option<&DemoKind>, rng: &mut ChaCha8Rng) -> Self {
        let Some(kind) = kind else {
            return Self::default();
        };
        let mut conditions = Self {
            depth: within(kind.depth, rng),
            weathering: Weathering::draw(kind, rng),
            lost: (kind.lost[1] > 0.0).then_some(kind.lost),
            scan: ScanErrors {
                noise: within(kind.noise, rng),
                ripple_mm: within(kind.ripple_mm, rng),
                smoothing_mm: within(kind.smoothing_mm, rng),
                slow: None,
                holes: number_within(kind.holes, rng),
                spikes: number_within(kind.spikes, rng),
                blobs: number_within(kind.blobs, rng),
            },
            base: *one_of(kind.bases, rng),
            thickness: within(kind.thickness, rng),
            ink: Some(InkAmount {
                spread_mm: within(kind.spread_mm, rng),
                strength: within(kind.strength, rng),
                dryness: within(kind.dryness, rng),
                uneven: within(kind.uneven, rng),
                contact: Noise::draw(rng),
                smear: within(kind.smear, rng),
                smears: Noise::draw(rng),
            }),
            paper: PaperGeometry::draw(kind, rng),
            crop: kind.crop,
            raised_mm: 0.0,
            slid: None,
        };
        // Kinds without these draw no random numbers for them.
        conditions.scan.slow = SlowErrors::draw(kind, rng);
        if kind.raised_mm[1] > 0.0 {
            conditions.raised_mm = within(kind.raised_mm, rng);
        }
        conditions.slid = SlidPart::draw(kind, rng);
        conditions
    }
}
