//! Kinds of blocks: each is a set of ranges of the same physical quantities.

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::page_appearance::AppearanceRanges;
use super::seeding::{hash, part_rng};
use crate::kind::NumberRange;
use mocban_core::domain::enum_names;

/// What is special about a generated block or its page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BlockKind {
    /// A page scanned almost straight.
    Plain,
    /// Columns with parts in characters of half the size, two by two.
    Notes,
    /// A sheet that is shrunk, sheared and warped, seen in slight perspective.
    Warp,
    /// A page image that is turned by 90, 180 or 270 degrees.
    QuarterTurn,
    /// A block with text on both sides; the page is of the back.
    Back,
    /// One half of the page, cut at the fold.
    HalfPage,
    /// One half of the page beside a half of another block's page.
    OpenedBook,
    /// A block with broken corners, wide cracks and lost regions.
    Broken,
    /// A block scanned in a holder whose jaws are higher than its face.
    Holder,
    /// A block scanned on a turntable.
    Turntable,
    /// A sheet on the bed of a scanner.
    ScannerBed,
    /// Characters of 0.85 times the usual size.
    Fine,
    /// The page of another block.
    WrongPage,
    /// Text on both sides, notes, a warped sheet and damage, most of them milder.
    Mixed,
    /// A page image in which a character is 20 to 50 pixels high, often with thin strokes.
    Coarse,
    /// Notes whose rows are as far apart as those of the text, also in single rows and on one side only.
    TallNotes,
    /// Rules in pieces, leaning or doubled, ridges beyond the frame, and a torn fold.
    BrokenRules,
    /// A page with few characters, such as a list or the end of a text.
    Sparse,
    /// Two registers of text, one above the other.
    Registers,
    /// A page with stamps, blots and dark stains.
    Stamped,
    /// Any of the faults of the kinds from `coarse` on at once, as in the scans of libraries.
    Library,
    /// An intact small block, usually with 30 to 70 characters.
    Small,
}

enum_names! { pub BlockKind, "a kind of block":
    Plain = "plain", Notes = "notes", Warp = "warp", QuarterTurn = "quarter-turn", Back = "back",
    HalfPage = "half-page", OpenedBook = "opened-book", Broken = "broken", Holder = "holder",
    Turntable = "turntable", ScannerBed = "scanner-bed", Fine = "fine", WrongPage = "wrong-page", Mixed = "mixed",
    Coarse = "coarse", TallNotes = "tall-notes", BrokenRules = "broken-rules", Sparse = "sparse",
    Registers = "registers", Stamped = "stamped", Library = "library", Small = "small",
}

/// Which part of the page an image shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PageExtent {
    /// All of it.
    Whole,
    /// One half, cut at the fold.
    Half,
    /// One half beside a half of another page.
    OpenedBook,
}

/// What holds the block in the scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BlockSupport {
    /// Nothing.
    Nothing,
    /// Jaws at two sides, higher than the face.
    Holder,
    /// A disc below the block.
    Turntable,
}

/// Ranges from which the conditions of a block and its page are drawn.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockRanges {
    /// Width and height of the text, from which the numbers of columns and rows follow, mm.
    pub text_mm: [NumberRange; 2],
    /// Size of the characters as a fraction of the usual size.
    pub scale: NumberRange,
    /// Fraction of the columns that contain notes.
    pub notes: NumberRange,
    /// What makes the page unlike a clean one.
    pub appearance: AppearanceRanges,
    /// Probability that the page is folded in the middle.
    pub folded: f64,
    /// Probability that both sides are carved.
    pub double_faced: f64,
    /// Whether the page is of the back.
    pub page_of_back: bool,
    /// Whether the page is of another block.
    pub page_of_other: bool,
    /// Which part of the page the image shows.
    pub extent: PageExtent,
    /// What holds the block in the scan.
    pub support: BlockSupport,
    /// Quarter turns of the image.
    pub turns: NumberRange,
    /// Largest rotation of the image, degrees.
    pub rotation_deg: f64,
    /// Shrinkage of the sheet, drawn along u and along v.
    pub shrink: NumberRange,
    /// Largest shear of the sheet.
    pub shear: f64,
    /// Largest displacement by the warp, mm.
    pub warp_mm: NumberRange,
    /// Change of scale from the middle of the page to a point 150 mm away, by perspective.
    pub perspective: NumberRange,
    /// Resolution of the image, pixels per mm.
    pub px_per_mm: NumberRange,
    /// Width of the scanner's bed that shows around the sheet, mm.
    pub bed_mm: NumberRange,
    /// Number of regions that lost their strokes.
    pub lost: NumberRange,
    /// Number of cracks along the grain.
    pub cracks: NumberRange,
    /// Half the width of a crack, mm.
    pub crack_mm: NumberRange,
    /// Number of corners that broke off.
    pub broken_corners: NumberRange,
    /// Sagitta of bow and twist over the block, mm.
    pub bow_mm: NumberRange,
    /// Depth of the carved ground, mm.
    pub ground_mm: NumberRange,
    /// Height that wear removes from the stroke tops in patches, mm.
    pub wear_mm: NumberRange,
    /// Standard deviation of the scan's height noise, mm.
    pub noise_mm: NumberRange,
}

/// An intact block with a page scanned almost straight.
const PLAIN: BlockRanges = BlockRanges {
    text_mm: [[235.0, 300.0], [175.0, 222.0]],
    scale: [1.0, 1.0],
    notes: [0.0, 0.0],
    appearance: AppearanceRanges::CLEAN,
    folded: 0.5,
    double_faced: 0.15,
    page_of_back: false,
    page_of_other: false,
    extent: PageExtent::Whole,
    support: BlockSupport::Nothing,
    turns: [0.0, 0.0],
    rotation_deg: 1.5,
    shrink: [0.0, 0.015],
    shear: 0.003,
    warp_mm: [0.1, 0.4],
    perspective: [0.0, 0.0],
    px_per_mm: [8.0, 12.0],
    bed_mm: [0.0, 0.0],
    lost: [0.0, 5.0],
    cracks: [0.0, 1.0],
    crack_mm: [0.1, 0.25],
    broken_corners: [0.0, 0.0],
    bow_mm: [0.2, 1.5],
    ground_mm: [1.5, 3.0],
    wear_mm: [0.03, 0.25],
    noise_mm: [0.008, 0.025],
};

const NOTES: BlockRanges = BlockRanges {
    notes: [0.4, 0.85],
    px_per_mm: [10.0, 14.0],
    warp_mm: [0.1, 0.6],
    ..PLAIN
};

const WARP: BlockRanges = BlockRanges {
    rotation_deg: 4.0,
    shrink: [0.0, 0.03],
    shear: 0.01,
    warp_mm: [0.8, 1.5],
    perspective: [0.0, 0.02],
    ..PLAIN
};

const QUARTER_TURN: BlockRanges = BlockRanges {
    turns: [1.0, 3.0],
    rotation_deg: 4.0,
    ..PLAIN
};

const BACK: BlockRanges = BlockRanges {
    double_faced: 1.0,
    page_of_back: true,
    ..PLAIN
};

const HALF_PAGE: BlockRanges = BlockRanges {
    folded: 1.0,
    extent: PageExtent::Half,
    rotation_deg: 3.0,
    warp_mm: [0.1, 0.8],
    ..PLAIN
};

const OPENED_BOOK: BlockRanges = BlockRanges {
    extent: PageExtent::OpenedBook,
    perspective: [0.0, 0.015],
    ..HALF_PAGE
};

const BROKEN: BlockRanges = BlockRanges {
    lost: [10.0, 30.0],
    cracks: [1.0, 3.0],
    crack_mm: [0.2, 0.6],
    broken_corners: [1.0, 2.0],
    wear_mm: [0.2, 0.45],
    ..PLAIN
};

const HOLDER: BlockRanges = BlockRanges {
    support: BlockSupport::Holder,
    ..PLAIN
};

const TURNTABLE: BlockRanges = BlockRanges {
    support: BlockSupport::Turntable,
    ..PLAIN
};

const SCANNER_BED: BlockRanges = BlockRanges {
    bed_mm: [8.0, 30.0],
    rotation_deg: 4.0,
    ..PLAIN
};

const FINE: BlockRanges = BlockRanges {
    scale: [0.85, 0.85],
    px_per_mm: [10.0, 14.0],
    ..PLAIN
};

const WRONG_PAGE: BlockRanges = BlockRanges {
    page_of_other: true,
    ..PLAIN
};

const MIXED: BlockRanges = BlockRanges {
    notes: [0.2, 0.5],
    double_faced: 1.0,
    rotation_deg: 2.5,
    shrink: [0.0, 0.02],
    shear: 0.005,
    warp_mm: [0.4, 1.0],
    px_per_mm: [9.0, 12.0],
    lost: [4.0, 10.0],
    cracks: [1.0, 2.0],
    ..PLAIN
};

const COARSE: BlockRanges = BlockRanges {
    scale: [0.85, 1.0],
    appearance: AppearanceRanges {
        thin_ink: 0.5,
        ..AppearanceRanges::CLEAN
    },
    px_per_mm: [2.5, 4.5],
    ..PLAIN
};

const TALL_NOTES: BlockRanges = BlockRanges {
    notes: [0.3, 0.9],
    appearance: AppearanceRanges {
        tall_notes: 1.0,
        ..AppearanceRanges::CLEAN
    },
    px_per_mm: [4.0, 12.0],
    ..PLAIN
};

const BROKEN_RULES: BlockRanges = BlockRanges {
    appearance: AppearanceRanges {
        broken_rules: 1.0,
        torn_fold: 0.5,
        ..AppearanceRanges::CLEAN
    },
    px_per_mm: [4.0, 12.0],
    ..PLAIN
};

const SPARSE: BlockRanges = BlockRanges {
    appearance: AppearanceRanges {
        sparse: 1.0,
        ..AppearanceRanges::CLEAN
    },
    px_per_mm: [4.0, 12.0],
    ..PLAIN
};

const REGISTERS: BlockRanges = BlockRanges {
    appearance: AppearanceRanges {
        registers: 1.0,
        ..AppearanceRanges::CLEAN
    },
    px_per_mm: [4.0, 12.0],
    ..PLAIN
};

const STAMPED: BlockRanges = BlockRanges {
    appearance: AppearanceRanges {
        blots: [0.0, 8.0],
        stamps: [1.0, 4.0],
        ..AppearanceRanges::CLEAN
    },
    px_per_mm: [4.0, 12.0],
    ..PLAIN
};

const LIBRARY: BlockRanges = BlockRanges {
    scale: [0.8, 1.0],
    notes: [0.0, 0.6],
    appearance: AppearanceRanges {
        tall_notes: 0.5,
        broken_rules: 0.6,
        torn_fold: 0.3,
        sparse: 0.15,
        registers: 0.15,
        thin_ink: 0.4,
        blots: [0.0, 5.0],
        stamps: [0.0, 2.0],
    },
    rotation_deg: 2.5,
    shrink: [0.0, 0.02],
    shear: 0.005,
    warp_mm: [0.1, 0.8],
    px_per_mm: [2.5, 8.0],
    ..PLAIN
};

const SMALL: BlockRanges = BlockRanges {
    text_mm: [[70.0, 90.0], [110.0, 130.0]],
    folded: 0.0,
    double_faced: 0.0,
    lost: [0.0, 0.0],
    cracks: [0.0, 0.0],
    bow_mm: [0.1, 0.5],
    ..PLAIN
};

/// Which block is made. The same options give the same bytes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BlockOptions {
    /// What is special about the block or its page.
    pub kind: BlockKind,
    /// Random seed.
    pub seed: u64,
    /// Approximate spacing of the mesh's vertices, mm.
    pub spacing_mm: f64,
}

impl BlockOptions {
    /// Returns the seed of the parts, which differs between kinds.
    pub(super) fn part_seed(self) -> u64 {
        hash(self.seed, self.kind as u64, 0)
    }

    /// Returns the random numbers of a part.
    pub(super) fn rng(self, part: u64) -> ChaCha8Rng {
        part_rng(self.part_seed(), part)
    }
}

impl BlockKind {
    /// Returns the ranges of the conditions.
    pub(super) const fn ranges(self) -> &'static BlockRanges {
        match self {
            Self::Plain => &PLAIN,
            Self::Notes => &NOTES,
            Self::Warp => &WARP,
            Self::QuarterTurn => &QUARTER_TURN,
            Self::Back => &BACK,
            Self::HalfPage => &HALF_PAGE,
            Self::OpenedBook => &OPENED_BOOK,
            Self::Broken => &BROKEN,
            Self::Holder => &HOLDER,
            Self::Turntable => &TURNTABLE,
            Self::ScannerBed => &SCANNER_BED,
            Self::Fine => &FINE,
            Self::WrongPage => &WRONG_PAGE,
            Self::Mixed => &MIXED,
            Self::Coarse => &COARSE,
            Self::TallNotes => &TALL_NOTES,
            Self::BrokenRules => &BROKEN_RULES,
            Self::Sparse => &SPARSE,
            Self::Registers => &REGISTERS,
            Self::Stamped => &STAMPED,
            Self::Library => &LIBRARY,
            Self::Small => &SMALL,
        }
    }
}
