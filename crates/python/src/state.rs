//! An alignment as JSON and bytes, for `pickle`.

use serde::{Deserialize, Serialize};

use mocban_align::stages::normalize::{Normalized, PrintMasks};
use mocban_align::stages::register::Registered;
use mocban_align::stages::{AlignedPair, Print, ScanHints};
use mocban_core::domain::{DepthScale, FitOutcome, LengthUnit, NormalizeOutcome, RegisterOutcome};
use mocban_core::raster::{DepthMap, Grid, Mask, PrintImage};

/// Version of the form.
const FORM: u32 = 1;

#[derive(Serialize, Deserialize)]
struct AlignmentNumbers {
    form: u32,
    unit: Option<LengthUnit>,
    scanned_face_down: Option<bool>,
    fit: FitOutcome,
    scale: DepthScale,
    normalize: NormalizeOutcome,
    register: RegisterOutcome,
    depth_size: [usize; 2],
    print_size: [usize; 2],
    stroke_map_sides: Vec<usize>,
    print_turned: Option<u8>,
    ignored_profile: Option<String>,
}

/// What the functions of an alignment need of it.
pub(crate) struct NeededParts {
    pub(crate) hints: ScanHints,
    pub(crate) fit: FitOutcome,
    pub(crate) depth: DepthMap,
    pub(crate) normalize: NormalizeOutcome,
    /// Masks of the interpretation of the print that was used.
    pub(crate) masks: PrintMasks,
    pub(crate) register: RegisterOutcome,
    pub(crate) stroke_maps: Vec<Grid<u8>>,
}

impl NeededParts {
    /// Returns an alignment with one interpretation of the print, or `None` if `normalize` lacks the one of `register`.
    pub(crate) fn into_pair(mut self) -> Option<AlignedPair> {
        self.normalize.inks = vec![*self.normalize.inks.get(self.register.ink)?];
        self.register.ink = 0;
        Some(AlignedPair {
            hints: self.hints,
            fit: self.fit,
            depth: self.depth,
            normalized: Normalized {
                outcome: self.normalize,
                prints: vec![self.masks],
            },
            registered: Registered {
                outcome: self.register,
                canvas_print: Mask::new(0, 0, false),
                canvas_depths: Vec::new(),
                stroke_maps: self.stroke_maps,
                confidence_inputs: Vec::new(),
            },
        })
    }
}

/// Removes what no function of an alignment needs.
pub(crate) fn needed(mut pair: AlignedPair) -> AlignedPair {
    let register = pair.registered.outcome;
    let parts = NeededParts {
        hints: pair.hints,
        fit: pair.fit,
        depth: pair.depth,
        normalize: pair.normalized.outcome,
        masks: pair.normalized.prints.swap_remove(register.ink),
        register,
        stroke_maps: pair.registered.stroke_maps,
    };
    parts.into_pair().expect("the pose is that of a known ink")
}

/// Bytes for each pixel of the masks of an alignment: its own masks, and the binarizations that its print keeps.
const MASK_PIXEL_BYTES: usize = 24;

/// Estimates the memory that an alignment and its print take, in bytes.
pub(crate) fn held_bytes(pair: &AlignedPair, print: &Print) -> usize {
    let masks = pair.normalized.prints.iter();
    let masks: usize = masks.map(|masks| masks.ink.data().len()).sum();
    let maps = pair.registered.stroke_maps.iter();
    let maps: usize = maps.map(|map| map.data().len()).sum();
    size_of_val(pair.depth.levels.data())
        + print.image().rgb.bytes()
        + MASK_PIXEL_BYTES * masks
        + maps
}

/// Returns the numbers and the images of an alignment.
pub(crate) fn save(pair: &AlignedPair, print: &Print) -> (String, Vec<u8>) {
    let (levels, image) = (&pair.depth.levels, print.image());
    let maps = &pair.registered.stroke_maps;
    let numbers = AlignmentNumbers {
        form: FORM,
        unit: pair.hints.unit,
        scanned_face_down: pair.hints.scanned_face_down,
        fit: pair.fit.clone(),
        scale: pair.depth.scale.clone(),
        normalize: pair.normalized.outcome.clone(),
        register: pair.registered.outcome.clone(),
        depth_size: [levels.width(), levels.height()],
        print_size: [image.rgb.width(), image.rgb.height()],
        stroke_map_sides: maps.iter().map(Grid::width).collect(),
        print_turned: image.turned,
        ignored_profile: image.ignored_profile.clone(),
    };
    let mut images = Vec::new();
    images.extend(levels.data().iter().flat_map(|level| level.to_le_bytes()));
    images.extend(pair.normalized.prints[0].to_grey().data());
    images.extend(
        image
            .rgb
            .to_rgb16()
            .data()
            .as_flattened()
            .iter()
            .flat_map(|v| v.to_le_bytes()),
    );
    for map in maps {
        images.extend(map.data());
    }
    (serde_json::json!(numbers).to_string(), images)
}

/// Returns the alignment of a state, or `None` if the state is damaged.
pub(crate) fn restore(numbers: &str, images: &[u8]) -> Option<(AlignedPair, Print)> {
    let numbers: AlignmentNumbers = serde_json::from_str(numbers).ok()?;
    let is_whole = numbers.form == FORM
        && numbers.normalize.inks.len() == 1
        && !numbers.register.metrics.is_empty();
    if !is_whole {
        return None;
    }
    let mut images = ImageBytes(images);
    let levels = images.sixteen(numbers.depth_size, 1)?;
    let levels = Grid::from_vec(numbers.depth_size[0], numbers.depth_size[1], levels)?;
    let [width, height] = numbers.print_size;
    let scale = numbers.normalize.mask_scale();
    let mask_size = scale.mask_size(numbers.print_size)?;
    (scale.print_size(mask_size) == numbers.print_size).then_some(())?;
    let masks = Grid::from_vec(mask_size[0], mask_size[1], images.eight(mask_size)?)?;
    let samples = images.sixteen(numbers.print_size, 3)?;
    let rgb = Grid::from_vec(width, height, samples.as_chunks::<3>().0.to_vec())?;
    let maps = numbers.stroke_map_sides.iter();
    let maps = maps.map(|side| Grid::from_vec(*side, *side, images.eight([*side; 2])?));
    let stroke_maps = maps.collect::<Option<Vec<_>>>()?;
    let print = PrintImage {
        rgb: rgb.into(),
        turned: numbers.print_turned,
        ignored_profile: numbers.ignored_profile,
    };
    let parts = NeededParts {
        hints: ScanHints {
            unit: numbers.unit,
            scanned_face_down: numbers.scanned_face_down,
        },
        fit: numbers.fit,
        depth: DepthMap {
            levels,
            scale: numbers.scale,
        },
        normalize: numbers.normalize,
        masks: PrintMasks::from_grey(&masks, scale),
        register: numbers.register,
        stroke_maps,
    };
    let pair = parts.into_pair()?;
    images.0.is_empty().then(|| (pair, print.into()))
}

/// Images one after another.
struct ImageBytes<'a>(&'a [u8]);

impl ImageBytes<'_> {
    fn eight(&mut self, [width, height]: [usize; 2]) -> Option<Vec<u8>> {
        let (image, rest) = self.0.split_at_checked(width.checked_mul(height)?)?;
        self.0 = rest;
        Some(image.to_vec())
    }

    fn sixteen(&mut self, [width, height]: [usize; 2], channels: usize) -> Option<Vec<u16>> {
        let bytes = self.eight([width.checked_mul(2 * channels)?, height])?;
        let values = bytes.as_chunks::<2>().0.iter();
        Some(values.map(|value| u16::from_le_bytes(*value)).collect())
    }
}
