//! Kinds of pairs: each is a set of ranges of the same physical quantities.

/// Minimum and maximum of a quantity that is drawn uniformly.
pub(super) type NumberRange = [f64; 2];

/// What a scan contains besides the carved face.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Base {
    /// Nothing, or, in one of eight scans, thin side walls and a flat bottom.
    Ordinary,
    /// Side walls and a rough bottom.
    Foot,
    /// Side walls and a second carved face with another character.
    SecondFace,
    /// Side walls and the table on which the block lies.
    Table,
    /// Parts of a surface behind the block, seen through the holes of the scan.
    SeenThroughHoles,
    /// One or two other carved pieces beside the block, each with another character.
    OtherPieces,
}

/// Which of mesh and print shows all eight neighbouring characters, if either does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Crop {
    /// Neither: both are cut around the character.
    Character,
    /// The mesh shows 3 x 3 characters, the print one.
    WideMesh,
    /// The print shows 3 x 3 characters, the mesh one.
    WidePrint,
    /// The mesh shows the uncarved wood around the carved area, up to some distance. The print does not.
    WideRim,
}

/// Colours of a sheet and of the ink on it, red, green and blue, 0..=255. The ink is made lighter or darker, so that its
/// brightness has the drawn distance from the sheet's.
#[derive(Debug, Clone, Copy)]
pub(super) struct InkColours {
    pub sheet: [f64; 3],
    pub ink: [f64; 3],
}

/// Ranges from which the conditions of a pair are drawn.
#[derive(Debug, Clone, Copy)]
pub(super) struct DemoKind {
    /// Carved depth as a fraction of an ordinary block's, which is 1.0 to 1.4 mm.
    pub depth: NumberRange,
    /// Height that wear removes from the stroke tops in patches, mm.
    pub abrasion_mm: NumberRange,
    /// Height that wear removes from the stroke edges, mm.
    pub rounding_mm: NumberRange,
    /// Fraction of the carved depth that is filled with dirt.
    pub fill: NumberRange,
    /// Fraction of the stroke area that broke off after printing.
    pub lost: NumberRange,
    /// Factor of the height noise of an ordinary scan.
    pub noise: NumberRange,
    /// Amplitude of smooth scan errors with features of half a millimetre, mm.
    pub ripple_mm: NumberRange,
    /// Standard deviation of the Gaussian by which the scan is smoothed, mm.
    pub smoothing_mm: NumberRange,
    /// Amplitude of slow scan errors with features of some millimetres, mm.
    pub drift_mm: NumberRange,
    /// Height of the step between the two views that a scan was stitched from, mm. 0 for one view.
    pub step_mm: NumberRange,
    /// Height of neighbours and column rules above the character's tops, mm.
    pub raised_mm: NumberRange,
    /// Number of large holes of the scan.
    pub holes: NumberRange,
    /// Number of far outlier vertices.
    pub spikes: NumberRange,
    /// Number of floating pieces.
    pub blobs: NumberRange,
    /// What the scan contains besides the carved face; each is as likely as the others.
    pub bases: &'static [Base],
    /// Thickness of the block as a fraction of the character's size.
    pub thickness: NumberRange,
    /// Distance by which the ink spreads beyond the printing surface, mm; may be negative.
    pub spread_mm: NumberRange,
    /// Density of the ink.
    pub strength: NumberRange,
    /// Degree of dryness in dry patches, where ink is missing inside the strokes. 0 for none.
    pub dryness: NumberRange,
    /// Fraction of the ink that is missing where the sheet had the least contact.
    pub uneven: NumberRange,
    /// Density of ink smeared on the carved background.
    pub smear: NumberRange,
    /// Angle between the camera's axis and the sheet's normal, degrees.
    pub tilt_deg: NumberRange,
    /// Amplitude of the smooth warp of the sheet, mm.
    pub warp_mm: NumberRange,
    /// Fraction by which the sheet shrank along one axis. It shrank less along the other.
    pub shrink: NumberRange,
    /// Which of mesh and print shows all neighbours.
    pub crop: Crop,
    /// Distance by which the part of the block beyond a crack slid along the crack, mm. 0 without a crack.
    pub slid_mm: NumberRange,
    /// Ratio of the picture's scales along its two sides, minus 1.
    pub stretch: NumberRange,
    /// Distance by which the smaller part of a torn or folded sheet is displaced, mm. 0 for a whole sheet.
    pub displaced_mm: NumberRange,
    /// Whether only one part of a torn sheet is left, on a dark ground.
    pub is_half: bool,
    /// Colours of sheet and ink; each is as likely as the others. Empty for black ink on an ordinary sheet.
    pub colours: &'static [InkColours],
}

/// A clean block, an ordinary scan and a good print.
const ORDINARY: DemoKind = DemoKind {
    depth: [0.9, 1.1],
    abrasion_mm: [0.0, 0.0],
    rounding_mm: [0.0, 0.0],
    fill: [0.0, 0.0],
    lost: [0.0, 0.0],
    noise: [1.0, 1.0],
    ripple_mm: [0.0, 0.0],
    smoothing_mm: [0.0, 0.0],
    drift_mm: [0.0, 0.0],
    step_mm: [0.0, 0.0],
    raised_mm: [0.0, 0.0],
    holes: [0.0, 0.0],
    spikes: [0.0, 0.0],
    blobs: [0.0, 0.0],
    bases: &[Base::Ordinary],
    thickness: [0.3, 1.0],
    spread_mm: [-0.01, 0.06],
    strength: [0.75, 0.97],
    dryness: [0.0, 0.7],
    uneven: [0.0, 0.15],
    smear: [0.0, 0.0],
    tilt_deg: [0.0, 0.0],
    warp_mm: [0.0, 0.0],
    shrink: [0.0, 0.0],
    crop: Crop::Character,
    slid_mm: [0.0, 0.0],
    stretch: [0.0, 0.0],
    displaced_mm: [0.0, 0.0],
    is_half: false,
    colours: &[],
};

/// A moderate mix of wear, dirt, scan errors, uneven ink and deformed sheets.
pub(super) const FIELD: DemoKind = DemoKind {
    depth: [0.55, 1.15],
    abrasion_mm: [0.0, 0.16],
    rounding_mm: [0.0, 0.14],
    fill: [0.0, 0.45],
    lost: [0.0, 0.08],
    noise: [1.0, 3.0],
    ripple_mm: [0.0, 0.02],
    smoothing_mm: [0.0, 0.07],
    holes: [0.0, 2.0],
    spikes: [0.0, 12.0],
    spread_mm: [-0.05, 0.11],
    strength: [0.55, 0.97],
    dryness: [0.0, 1.0],
    uneven: [0.0, 0.5],
    smear: [0.0, 0.12],
    warp_mm: [0.0, 0.08],
    shrink: [0.0, 0.015],
    ..ORDINARY
};

/// Stroke tops worn down in patches and rounded at their edges.
pub(super) const WORN: DemoKind = DemoKind {
    abrasion_mm: [0.02, 0.45],
    rounding_mm: [0.03, 0.40],
    ..ORDINARY
};

/// Shallow carving.
pub(super) const SHALLOW: DemoKind = DemoKind {
    depth: [0.16, 0.55],
    ..ORDINARY
};

/// Dirt in the valleys.
pub(super) const FILLED: DemoKind = DemoKind {
    fill: [0.15, 0.85],
    ..ORDINARY
};

/// Smoothed scans.
pub(super) const SMOOTHED: DemoKind = DemoKind {
    smoothing_mm: [0.04, 0.26],
    ..ORDINARY
};

/// Scans with strong noise and ripples.
pub(super) const NOISY: DemoKind = DemoKind {
    noise: [1.5, 8.0],
    ripple_mm: [0.0, 0.07],
    ..ORDINARY
};

/// Slow height errors, up to more than the carved depth.
pub(super) const DRIFT: DemoKind = DemoKind {
    drift_mm: [0.1, 1.2],
    ..ORDINARY
};

/// Scans stitched from two views that do not meet: one is higher, and tilted.
pub(super) const STITCHED: DemoKind = DemoKind {
    step_mm: [0.05, 0.5],
    ..ORDINARY
};

/// Rules and neighbours that are higher than the character.
pub(super) const RAISED: DemoKind = DemoKind {
    raised_mm: [0.05, 0.6],
    ..ORDINARY
};

/// A block or foot deeper than it is wide.
pub(super) const THICK: DemoKind = DemoKind {
    bases: &[Base::Foot],
    thickness: [1.1, 4.0],
    ..ORDINARY
};

/// Both faces carved, with different characters.
pub(super) const DOUBLE_FACED: DemoKind = DemoKind {
    bases: &[Base::SecondFace],
    thickness: [0.3, 3.0],
    ..ORDINARY
};

/// A block on a table that was scanned with it.
pub(super) const TABLE: DemoKind = DemoKind {
    bases: &[Base::Table],
    thickness: [0.2, 2.8],
    ..ORDINARY
};

/// Spikes and floating pieces.
pub(super) const DEBRIS: DemoKind = DemoKind {
    spikes: [0.0, 400.0],
    blobs: [1.0, 30.0],
    ..ORDINARY
};

/// Holes through which the bottom of the block or a surface behind it is seen.
pub(super) const HOLES: DemoKind = DemoKind {
    holes: [1.0, 12.0],
    bases: &[Base::SeenThroughHoles, Base::Foot],
    thickness: [0.3, 3.0],
    ..ORDINARY
};

/// Too little ink.
pub(super) const DRY: DemoKind = DemoKind {
    spread_mm: [-0.12, 0.0],
    strength: [0.3, 0.85],
    dryness: [0.5, 1.3],
    uneven: [0.0, 0.6],
    ..ORDINARY
};

/// Too much ink, which fills narrow gaps and smears on the background.
pub(super) const HEAVY: DemoKind = DemoKind {
    spread_mm: [0.07, 0.25],
    strength: [0.88, 1.0],
    dryness: [0.0, 0.2],
    smear: [0.0, 0.4],
    ..ORDINARY
};

/// A photograph of the print, taken at an angle.
pub(super) const PHOTO: DemoKind = DemoKind {
    tilt_deg: [3.0, 35.0],
    ..ORDINARY
};

/// Sheets warped by uneven drying.
pub(super) const WAVY: DemoKind = DemoKind {
    warp_mm: [0.05, 0.35],
    ..ORDINARY
};

/// Sheets that shrank more along one axis than along the other.
pub(super) const SHRUNK: DemoKind = DemoKind {
    shrink: [0.005, 0.06],
    ..ORDINARY
};

/// A large part of the strokes lost.
pub(super) const LOST: DemoKind = DemoKind {
    lost: [0.15, 0.60],
    ..ORDINARY
};

/// 3 x 3 characters in the mesh only.
pub(super) const GRID_MESH: DemoKind = DemoKind {
    crop: Crop::WideMesh,
    ..ORDINARY
};

/// 3 x 3 characters in the print only.
pub(super) const GRID_PRINT: DemoKind = DemoKind {
    crop: Crop::WidePrint,
    ..ORDINARY
};

/// Several of the above at once, most of them milder than in their own kind.
pub(super) const MIXED: DemoKind = DemoKind {
    abrasion_mm: [0.0, 0.2],
    rounding_mm: [0.0, 0.15],
    fill: [0.0, 0.4],
    lost: [0.0, 0.2],
    noise: [1.0, 3.0],
    holes: [0.0, 3.0],
    spikes: [0.0, 60.0],
    blobs: [0.0, 6.0],
    bases: &[Base::Ordinary, Base::Foot, Base::Table],
    thickness: [0.3, 2.0],
    dryness: [0.0, 1.0],
    uneven: [0.0, 0.4],
    tilt_deg: [0.0, 18.0],
    warp_mm: [0.0, 0.12],
    shrink: [0.0, 0.025],
    ..ORDINARY
};

/// A small character, not in the middle of a wide and noisy scan with an uncarved rim.
pub(super) const WIDE_RIM: DemoKind = DemoKind {
    noise: [1.0, 5.0],
    ripple_mm: [0.0, 0.05],
    crop: Crop::WideRim,
    ..ORDINARY
};

/// Several carved pieces in one scan.
pub(super) const PIECES: DemoKind = DemoKind {
    bases: &[Base::OtherPieces],
    ..ORDINARY
};

/// A crack through the character, one side of which slid and sank.
pub(super) const SLID: DemoKind = DemoKind {
    slid_mm: [0.3, 2.0],
    ..ORDINARY
};

/// Coloured ink that is hardly darker than the coloured sheet.
pub(super) const COLOURED: DemoKind = DemoKind {
    colours: &[
        // Red seal ink on brown paper.
        InkColours {
            sheet: [158.0, 118.0, 76.0],
            ink: [190.0, 60.0, 48.0],
        },
        // Brown ink on the blue paper of a proof.
        InkColours {
            sheet: [82.0, 120.0, 190.0],
            ink: [150.0, 96.0, 62.0],
        },
        // Red ink on greenish paper.
        InkColours {
            sheet: [140.0, 156.0, 120.0],
            ink: [192.0, 104.0, 84.0],
        },
        // Blue ink on yellow paper.
        InkColours {
            sheet: [216.0, 192.0, 126.0],
            ink: [120.0, 160.0, 214.0],
        },
        // Green ink on pink paper.
        InkColours {
            sheet: [222.0, 172.0, 164.0],
            ink: [112.0, 176.0, 132.0],
        },
    ],
    ..ORDINARY
};

/// Pictures that were scaled unequally.
pub(super) const STRETCHED: DemoKind = DemoKind {
    stretch: [0.2, 0.35],
    ..ORDINARY
};

/// Sheets torn or folded through the character, whose parts do not meet.
pub(super) const TORN: DemoKind = DemoKind {
    displaced_mm: [1.0, 3.0],
    ..ORDINARY
};

/// Torn halves of sheets on a dark ground.
pub(super) const HALF_PRINT: DemoKind = DemoKind {
    is_half: true,
    ..ORDINARY
};
