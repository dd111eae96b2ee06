//! A face and a page beside each other, on which a person chooses the same places.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::block_error::BlockViewError;
use super::page_layers::{PageRegion, jpeg, overlay, relief, whole_jpeg};
use super::page_picture::PagePicture;
use super::page_view::not_aligned;
use super::registered_face::{outcome, read_face, stored_block, unusable};
use crate::pictures::Rgb;
use mocban_align::block::{
    AlignOutcome, CarvedFace, ControlPointError, FaceOutcome, HEIGHT_STEP_MM, PageMap, align_at,
};
use mocban_catalog::{BlockDetail, Catalog};
use mocban_core::domain::{
    Affine2, ArtifactSet, BlockName, BlockSide, BlockStage, ContentHash, ControlPoint,
    ControlPoints,
};
use mocban_core::raster::ImageLimits;
use mocban_store::Project;

/// Longer side of a picture, pixels. One pixel is then about 0.1 mm.
const LONGEST_SIDE: f64 = 3000.0;

/// The faces of a block and its page.
#[derive(Debug)]
pub struct BlockCorrection {
    name: BlockName,
    faces: Vec<FacePicture>,
    page: PagePicture,
    mesh_hash: ContentHash,
    saved: Option<ControlPoints>,
    /// The side that is aligned with the page.
    aligned: Option<BlockSide>,
    /// The side that the list names.
    listed: Option<BlockSide>,
    failure: Option<String>,
}

/// A face, and the map from its millimetres to the pixels of its picture.
#[derive(Debug)]
struct FacePicture {
    side: BlockSide,
    face: CarvedFace,
    from_face: Affine2,
    size: [usize; 2],
}

/// The same place in both pictures.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PicturePoint {
    /// Pixel of the picture of the face.
    pub face: [f64; 2],
    /// Pixel of the image of the page.
    pub page: [f64; 2],
}

/// An alignment that starts from points, and the picture that shows it.
#[derive(Debug, Clone)]
pub struct TriedAlignment {
    /// The points as they are stored.
    pub points: ControlPoints,
    /// Fraction of the places of the face that agree with the page, 0..=1.
    pub agreement: f64,
    /// Relief and ink over each other, as JPEG.
    pub overlay: Vec<u8>,
}

/// Why points give no alignment.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CorrectionError {
    /// The block has no such face.
    #[error("the {0} of the block shows no face")]
    NoFace(BlockSide),
    /// Nothing was scanned at a point.
    #[error("point {number} lies beside the scanned face: choose a place on the relief")]
    BesideFace {
        /// Which one, from 1.
        number: usize,
    },
    /// A point lies outside the page.
    #[error("point {number} lies outside the page")]
    OutsidePage {
        /// Which one, from 1.
        number: usize,
    },
    /// There are more points than are stored.
    #[error("{count} points are too many: choose at most {}", ControlPoints::MAX)]
    TooMany {
        /// How many.
        count: usize,
    },
    /// The points contradict each other, or lead to no agreement.
    #[error(transparent)]
    Points(#[from] ControlPointError),
}

impl BlockCorrection {
    /// Reads a block.
    ///
    /// # Errors
    /// Returns an error if the block has no face yet, or if the catalog, the page or the heights cannot be read.
    pub async fn read(
        catalog: &Catalog,
        project: &Project,
        name: &BlockName,
        limits: ImageLimits,
    ) -> Result<Self, BlockViewError> {
        let detail = stored_block(catalog, name).await?;
        let (name, project) = (name.clone(), project.clone());
        let read = move || Self::read_files(name, &detail, &project, &limits);
        tokio::task::spawn_blocking(read).await?
    }

    fn read_files(
        name: BlockName,
        detail: &BlockDetail,
        project: &Project,
        limits: &ImageLimits,
    ) -> Result<Self, BlockViewError> {
        let stage = |stage| detail.stages.iter().find(|one| one.stage == stage);
        let Some(stored) = stage(BlockStage::Face) else {
            return Err(not_aligned(&name, detail));
        };
        let invalid = |why: serde_json::Error| unusable(BlockStage::Face, &why.to_string());
        let files = serde_json::from_value::<ArtifactSet>(stored.files.clone());
        let files = files.map_err(invalid)?;
        let mesh = serde_json::from_value(stored.provenance["mesh"].clone());
        let aligned = match stage(BlockStage::Align) {
            Some(align) => Some(outcome::<AlignOutcome>(align)?.side),
            None => None,
        };
        let found = outcome::<FaceOutcome>(stored)?.faces.into_iter();
        let faces = found.map(|found| {
            let face = read_face(project, &files, &found)?;
            Ok(FacePicture::new(found.side, face))
        });
        let page_path = &detail.state.attributes.page_path;
        Ok(Self {
            faces: faces.collect::<Result<_, BlockViewError>>()?,
            page: PagePicture::read(project, page_path, limits)?,
            mesh_hash: mesh.map_err(invalid)?,
            saved: detail.state.control_points.clone(),
            aligned,
            listed: detail.state.attributes.side,
            failure: (detail.state.failure.as_ref()).map(|stored| stored.failure.message.clone()),
            name,
        })
    }

    /// Returns what the page in the browser shows, as JSON.
    pub fn to_json(&self) -> Value {
        let sides = self.faces.iter();
        let sides = sides.map(|one| json!({"side": one.side, "size": one.size}));
        let page = &self.page.picture;
        // Points of other files say nothing about these.
        let saved = self
            .saved
            .as_ref()
            .filter(|points| self.is_for_files(points));
        let shown = saved.and_then(|points| Some((self.face(points.side)?, points)));
        let points = shown.map(|(face, points)| face.picture_points(&points.points));
        json!({
            "block": self.name,
            "sides": sides.collect::<Vec<_>>(),
            "side": shown.map(|(face, _)| face.side).or_else(|| self.likely_side()),
            "page_size": [page.width(), page.height()],
            "points": points.unwrap_or_default(),
            "min_points": ControlPoints::MIN,
            "is_saved": self.saved.is_some(),
            "saved_hash": self.saved.as_ref().map(ControlPoints::hash),
            "is_aligned": self.aligned.is_some(),
            "failure": self.failure,
        })
    }

    /// Returns the side that the page probably shows: the aligned one, the one that the list names, or the most carved one.
    fn likely_side(&self) -> Option<BlockSide> {
        let listed = self.listed.filter(|side| self.face(*side).is_some());
        let carved = |one: &FacePicture| one.face.relief.carved_fraction();
        let most = || {
            let faces = self.faces.iter().map(|one| (carved(one), one.side));
            faces.max_by(|a, b| a.0.total_cmp(&b.0))
        };
        let known = self.aligned.or(listed);
        known.or_else(|| most().map(|(_, side)| side))
    }

    /// Draws the relief of a face as it would be printed, after a number of quarter turns (clockwise), as JPEG. Returns
    /// `None` if the block has no such face.
    pub fn face_jpeg(&self, side: BlockSide, turns: u8) -> Option<Vec<u8>> {
        let shown = self.face(side)?;
        let bounds = [0, 1].map(|k: usize| {
            let low = shown.face.map.origin_mm[k];
            [
                low,
                low + (shown.size[k] as f64 - 1.0) / shown.from_face.scale(),
            ]
        });
        let (low, high) = (bounds.map(|side| side[0]), bounds.map(|side| side[1]));
        let map = PageMap::affine(&shown.from_face, low, high);
        let region = PageRegion::whole(shown.size);
        let picture = relief(&shown.face, &map, region, shown.size);
        Some(jpeg(&turned(picture, turns)))
    }

    /// Returns the image of the page as JPEG.
    pub fn page_jpeg(&self) -> Vec<u8> {
        whole_jpeg(&self.page.picture, LONGEST_SIDE as usize)
    }

    /// Aligns the page with a face from points.
    ///
    /// # Errors
    /// Returns an error if a point lies on no face or on no page, or if the points give no alignment.
    pub fn try_points(
        &self,
        side: BlockSide,
        points: &[PicturePoint],
    ) -> Result<TriedAlignment, CorrectionError> {
        let shown = self.face(side).ok_or(CorrectionError::NoFace(side))?;
        if points.len() > ControlPoints::MAX {
            return Err(CorrectionError::TooMany {
                count: points.len(),
            });
        }
        let size = [self.page.picture.width(), self.page.picture.height()];
        let chosen = points.iter().enumerate().map(|(index, point)| {
            let number = index + 1;
            let is_on_page = |k: usize| (-0.5..size[k] as f64 - 0.5).contains(&point.page[k]);
            if !(is_on_page(0) && is_on_page(1)) {
                return Err(CorrectionError::OutsidePage { number });
            }
            let mesh = shown.mesh_point(point.face);
            Ok(ControlPoint {
                mesh: mesh.ok_or(CorrectionError::BesideFace { number })?,
                page: point.page,
            })
        });
        let points = ControlPoints {
            mesh: self.mesh_hash,
            page: self.page.hash,
            side,
            points: chosen.collect::<Result<_, _>>()?,
        };
        let found = align_at(&shown.face, &self.page.ink, &points.points)?;
        let whole = self.whole_page();
        let size = whole.picture_size(LONGEST_SIDE as usize);
        let picture = overlay(&self.page.ink, &shown.face, &found.map, whole, size);
        Ok(TriedAlignment {
            points,
            agreement: found.agreement.agreeing,
            overlay: jpeg(&picture),
        })
    }

    fn face(&self, side: BlockSide) -> Option<&FacePicture> {
        self.faces.iter().find(|one| one.side == side)
    }

    fn is_for_files(&self, points: &ControlPoints) -> bool {
        points.mesh == self.mesh_hash && points.page == self.page.hash
    }

    fn whole_page(&self) -> PageRegion {
        PageRegion::whole([self.page.picture.width(), self.page.picture.height()])
    }
}

impl FacePicture {
    fn new(side: BlockSide, face: CarvedFace) -> Self {
        let sides = [face.map.heights.width(), face.map.heights.height()];
        let sides_mm = sides.map(|pixels| pixels as f64 * HEIGHT_STEP_MM);
        let scale = LONGEST_SIDE / sides_mm[0].max(sides_mm[1]);
        let from_face = Affine2::scale_shift(scale, face.map.origin_mm.map(|low| -low * scale));
        Self {
            side,
            face,
            from_face,
            size: sides_mm.map(|side| (side * scale).round().max(1.0) as usize),
        }
    }

    /// Returns the point of the mesh at a pixel of the picture; `None` beside the face.
    fn mesh_point(&self, pixel: [f64; 2]) -> Option<[f64; 3]> {
        let place = self.from_face.inverse()?.apply(pixel);
        self.face.mesh_point(place)
    }

    /// Returns stored points as points of the pictures.
    fn picture_points(&self, points: &[ControlPoint]) -> Vec<PicturePoint> {
        let shown = |point: &ControlPoint| {
            let [u, v, _] = self.face.map.frame.face_from_mesh(point.mesh);
            PicturePoint {
                face: self.from_face.apply([u, v]),
                page: point.page,
            }
        };
        points.iter().map(shown).collect()
    }
}

/// Turns a picture by quarter turns, clockwise.
fn turned(picture: Rgb, turns: u8) -> Rgb {
    (0..turns % 4).fold(picture, |before, _| {
        let height = before.height();
        Rgb::from_fn(height, before.width(), |x, y| before.at(y, height - 1 - x))
    })
}
