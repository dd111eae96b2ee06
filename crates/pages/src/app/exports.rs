//! The exports of a project: a folder for each purpose.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use mocban_export::ExportFormat;
use mocban_store::ReplacementFolder;

/// Side of the pictures of a dataset for training, pixels.
const CANVAS_PX: u32 = 256;
/// Folder of exports in a project.
const FOLDER: &str = "exports";
/// End of the name of an export of chosen pairs, which does not replace that of all pairs.
pub(super) const OF_CHOSEN: &str = "-chosen";

/// A purpose: its name, its format, and the question in both languages.
pub(super) type Purpose = (&'static str, ExportFormat, [&'static str; 2]);

pub(super) const PURPOSES: [Purpose; 8] = [
    (
        "excel",
        ExportFormat::Csv,
        ["a table for Excel", "bảng cho Excel"],
    ),
    (
        "excel-comma",
        ExportFormat::Csv,
        [
            "a table for Excel with decimal commas",
            "bảng cho Excel dùng dấu phẩy thập phân",
        ],
    ),
    (
        "table",
        ExportFormat::Parquet,
        ["a table for R or Python", "bảng cho R hoặc Python"],
    ),
    (
        "training",
        ExportFormat::HuggingFace,
        [
            "a dataset for training, 256 x 256 pixels",
            "bộ dữ liệu để huấn luyện, 256 x 256 điểm ảnh",
        ],
    ),
    (
        "mesh",
        ExportFormat::Mesh,
        [
            "scans with their prints for MeshLab or CloudCompare",
            "bản quét kèm bản in cho MeshLab hoặc CloudCompare",
        ],
    ),
    (
        "fiji",
        ExportFormat::Fiji,
        [
            "calibrated images for ImageJ or Fiji",
            "ảnh đã hiệu chuẩn cho ImageJ hoặc Fiji",
        ],
    ),
    (
        "web",
        ExportFormat::Viewer,
        ["3D pages for a web site", "trang 3D cho website"],
    ),
    (
        "all",
        ExportFormat::Jsonl,
        [
            "all numbers, and pictures as files",
            "mọi con số, hình ảnh thành tệp",
        ],
    ),
];

/// Returns the side of the pictures of a purpose, pixels, if they are not as large as the print.
pub(super) fn pictures_side(purpose: &str) -> Option<u32> {
    (purpose == "training").then_some(CANVAS_PX)
}

/// Returns the folder of the exports of a project.
pub(super) fn exports_dir(dir: &Path) -> PathBuf {
    dir.join(FOLDER)
}

/// Returns the purpose of the export with this name, and whether it has only chosen pairs.
pub(super) fn purpose_of(name: &str) -> Option<(&'static Purpose, bool)> {
    let (purpose, is_of_chosen) = match name.strip_suffix(OF_CHOSEN) {
        Some(purpose) => (purpose, true),
        None => (name, false),
    };
    let purpose = PURPOSES.iter().find(|(known, ..)| *known == purpose)?;
    Some((purpose, is_of_chosen))
}

/// Restores exports of a project that a process was replacing when it died, and removes what it left. Returns whether there
/// was one. Waits for the disk.
pub(super) fn recover_exports(dir: &Path) -> bool {
    let folder = exports_dir(dir);
    let entries = std::fs::read_dir(&folder).into_iter().flatten().flatten();
    let unfinished = entries.filter_map(|entry| {
        let name = entry.file_name().into_string().ok()?;
        let (name, _) = name.strip_prefix('.')?.split_once('.')?;
        is_export(name).then(|| name.to_owned())
    });
    let unfinished: BTreeSet<String> = unfinished.collect();
    // One that another process is writing is left alone.
    let recover =
        |name: &&String| matches!(ReplacementFolder::recover(&folder.join(name)), Ok(true));
    unfinished.iter().filter(recover).count() > 0
}

/// Returns whether an export of the app has this name.
pub(super) fn is_export(name: &str) -> bool {
    purpose_of(name).is_some()
}
