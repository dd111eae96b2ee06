//! What helps if only scans or only prints were chosen: other folders with the missing files, and failed pairs whose file is
//! replaced.

use std::path::{Path, PathBuf};

use maud::{Markup, html};

use super::components::grouped;
use super::failure::AppResult;
use super::folder_picker::PickerRoots;
use super::import_choice::{ImportPreview, Planned};
use super::projects::OpenProject;
use super::visit::Visit;
use mocban_catalog::{PairFilter, PairOrder};
use mocban_core::domain::{JobStatus, PairName, ThresholdMetric, one_line};

/// Most failed pairs whose files are compared by name.
const SEARCHED: usize = 200;
/// Most folders that are offered.
const SHOWN_FOLDERS: usize = 12;

/// What is missing beside the files that were chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum MissingKind {
    Scans,
    Prints,
}

/// A failed pair with a file that was chosen under its name.
#[derive(Debug)]
struct Replacement {
    pair: String,
    file: String,
    /// Folder of the file that stays.
    kept: PathBuf,
}

/// Ways to complete the files that were chosen.
#[derive(Debug)]
pub(super) struct ImportPartners {
    missing: MissingKind,
    folders: Vec<(PathBuf, u64)>,
    replacements: Vec<Replacement>,
}

impl ImportPartners {
    /// Finds folders with the missing files for a preview with only scans or only prints. `uploads` is the folder of files
    /// from browsers. Reads folders.
    pub(super) fn find(
        preview: &ImportPreview,
        chosen: &Path,
        roots: &PickerRoots,
        uploads: &Path,
    ) -> Option<Self> {
        let Ok(Planned::Pairs(plan, _)) = &preview.planned else {
            return None;
        };
        let missing = match &plan.alone {
            [scans, prints] if plan.pairs == 0 && prints.is_empty() && !scans.is_empty() => {
                MissingKind::Prints
            }
            [scans, prints] if plan.pairs == 0 && scans.is_empty() && !prints.is_empty() => {
                MissingKind::Scans
            }
            _ => return None,
        };
        let earlier = roots.read(uploads).ok();
        let earlier = earlier.into_iter().flat_map(|uploads| {
            let path = uploads.path;
            let folders = uploads.folders.into_iter();
            folders.map(move |(name, counts)| (path.join(name), counts))
        });
        let folders = earlier.filter_map(|(path, counts)| {
            let number = match missing {
                MissingKind::Scans => counts.meshes,
                MissingKind::Prints => counts.prints,
            };
            (number > 0 && path != chosen).then_some((path, number))
        });
        Some(Self {
            missing,
            folders: folders.take(SHOWN_FOLDERS).collect(),
            replacements: Vec::new(),
        })
    }

    /// Adds the failed pairs of a project whose names the files have.
    pub(super) async fn add_replacements(
        &mut self,
        open: &OpenProject,
        preview: &ImportPreview,
        roots: &PickerRoots,
    ) -> AppResult<()> {
        let Ok(Planned::Pairs(plan, _)) = &preview.planned else {
            return Ok(());
        };
        let filter = PairFilter {
            statuses: vec![JobStatus::Quarantined],
            ..PairFilter::default()
        };
        let (order, metric) = (PairOrder::Imported, ThresholdMetric::DEFAULT);
        let failed = open
            .catalog
            .pair_list(&filter, order, metric, None, SEARCHED);
        let [scans, prints] = &plan.alone;
        let files = match self.missing {
            MissingKind::Scans => prints,
            MissingKind::Prints => scans,
        };
        for pair in failed.await?.pairs {
            let attributes = pair.attributes;
            let name = attributes.name.as_str();
            let kept = match self.missing {
                MissingKind::Scans => attributes.mesh_path,
                MissingKind::Prints => attributes.print_path,
            };
            let kept = open.project.input_path(&kept);
            // Files are joined by their names.
            if kept.file_stem() != Some(name.as_ref()) {
                continue;
            }
            let kept = kept.parent().and_then(|folder| roots.allowed(folder).ok());
            // The pair of a file in a folder has the name of the folder too.
            let has_name = |file: &&String| Path::new(file).with_extension("") == Path::new(name);
            if let (Some(kept), Some(file)) = (kept, files.iter().find(has_name)) {
                self.replacements.push(Replacement {
                    pair: name.to_owned(),
                    file: file.clone(),
                    kept,
                });
            }
        }
        Ok(())
    }

    /// Returns the ways as links.
    pub(super) fn part(&self, visit: &Visit) -> Markup {
        let (field, title, join) = match self.missing {
            MissingKind::Prints => (
                "prints",
                visit.t(
                    "Where are the prints of these scans?",
                    "Bản in của các bản quét này ở đâu?",
                ),
                visit.t("Use the prints of", "Dùng bản in trong"),
            ),
            MissingKind::Scans => (
                "meshes",
                visit.t(
                    "Where are the scans of these prints?",
                    "Bản quét của các bản in này ở đâu?",
                ),
                visit.t("Use the scans of", "Dùng bản quét trong"),
            ),
        };
        let with = |folder: &Path| visit.query.with(field, &folder.to_string_lossy());
        html! {
            section.card #partners {
                h2 { (title) }
                @for replacement in &self.replacements {
                    p.row {
                        span { (visit.t("The pair", "Cặp")) " " b { (one_line(&replacement.pair)) } " " (visit.t("has failed.", "bị lỗi.")) }
                        a.button.primary href={ (visit.here) (with(&replacement.kept).with("changed", "yes").text()) } {
                            (visit.t("Replace its file by", "Thay tệp của nó bằng")) " " (one_line(&replacement.file))
                        }
                    }
                }
                p { (visit.t(
                    "Choose the folder that has them: one of the earlier uploads, or one of the folders below. Or send scans and prints together.",
                    "Hãy chọn thư mục có chúng: một lần gửi trước, hoặc một thư mục bên dưới. Hoặc gửi bản quét và bản in cùng lúc.",
                )) }
                @for (folder, number) in &self.folders {
                    p { a.button href={ (visit.here) (with(folder).text()) } {
                        (join) " " (one_line(&folder.file_name().unwrap_or_default().to_string_lossy())) " (" (grouped(*number)) ")"
                    } }
                }
            }
        }
    }
}

/// Says how the file of a failed pair is replaced.
pub(super) fn mending_part(visit: &Visit, pair: &PairName) -> Markup {
    let name = one_line(pair.as_str());
    html! {
        p.notice #mending {
            (visit.t("To replace a file of the pair", "Để thay tệp của cặp")) " " b { (name) } ": "
            (visit.t("name the new scan", "hãy đặt tên bản quét mới là")) " " code { (name) ".ply" } " "
            (visit.t("(or .stl, .obj), or the new print", "(hoặc .stl, .obj), hoặc bản in mới là")) " " code { (name) ".png" } " "
            (visit.t(
                "(or .jpg, .tif), and send it here. The page then offers to replace the file of the pair.",
                "(hoặc .jpg, .tif), rồi gửi tệp ở đây. Trang sẽ đề nghị thay tệp của cặp.",
            ))
        }
    }
}
