//! The format `mesh`: scans in the frame of their prints.

use std::sync::Mutex;

use super::single_results::{FileOfPair, ShownResult, SingleResultFormat};
use crate::format_writer::PairView;
use crate::mesh::{ScanFiles, ScanTitle};
use crate::pair_pictures::PictureError;
use mocban_core::locked;

const SCAN: &str = "the scan, binary PLY in millimetres: per vertex the colour of the print, `stroke` (1 on strokes) and \
    `height` over the fitted surface";
const GLB: &str =
    "the scan, glTF 2.0 in metres with the print as texture; `asset.extras` states units and maps";
const MATRIX: &str =
    "4 x 4 matrix from the original mesh file to `scan.ply`, a similarity without reflection";
const PROJECT: &str = "MeshLab project with `scan.ply`";

/// The frame, and how to open the files.
const USAGE: &str = "\
## Frame

`scan.ply` and `scan.glb` show the block in front of you, upright like its print: **x right, y up, z out of the block**.
The origin is on the fitted plane, at the centre of the print image. The block is carved in mirror writing, and no
motion makes it readable, so the scan is not reflected: x runs against the columns of the print. Unless
the print has different scales along two axes, a point (x, y, z) lies at the print pixel

```
u = (width - 1) / 2 - x / mm_per_print_px          mm_per_print_px = mesh_unit_per_px * mm_per_mesh_unit / scale
v = (height - 1) / 2 - y / mm_per_print_px
```

Only the texture coordinates of the GLB contain the reflection; they follow `print_from_mesh` exactly. The print is
projected along z, onto walls and the back too. Vertices and faces beside the print are white and have `stroke` 0.
Lengths are millimetres (metres in the GLB). If the unit of the mesh is unknown, they are mesh units, and the GLB takes
a mesh unit for a millimetre. Vertices that the file repeats are merged.

`stroke` is 1 where `height` is at least `threshold_depth`: heights are measured over the fitted surface, which may be
curved (see Coordinates), or over the levelling of the depth map, if it was levelled.

## Use

```sh
CloudCompare -O original.stl -APPLY_TRANS pairs/ID/matrix.txt -SAVE_MESHES   # moves the original onto scan.ply
meshlab pairs/ID/scan.mlp
```

```python
import trimesh
scan = trimesh.load(\"pairs/ID/scan.ply\", process=False)
vertices = scan.metadata[\"_ply_raw\"][\"vertex\"][\"data\"]
tops = scan.vertices[vertices[\"stroke\"] == 1]                # mm
```
";

/// The placed scans.
#[derive(Default)]
pub(super) struct PlacedScanFormat {
    /// Held while a scan is read. Until its repeated vertices are merged, a scan takes several times its memory.
    reading: Mutex<()>,
}

impl SingleResultFormat for PlacedScanFormat {
    const PURPOSE: &'static str = "Scans of carved blocks, moved onto their prints.";
    const FILES: &'static [FileOfPair] = &[
        ["ply", "pairs/*/scan.ply", SCAN],
        ["glb", "pairs/*/scan.glb", GLB],
        ["matrix", "pairs/*/matrix.txt", MATRIX],
        ["project", "pairs/*/scan.mlp", PROJECT],
    ];
    const USAGE: &'static str = USAGE;

    fn contents(
        &self,
        view: &PairView<'_>,
        shown: ShownResult<'_>,
    ) -> Result<Vec<Vec<u8>>, PictureError> {
        let pictures = shown.pictures;
        let print = pictures.source_print()?.picture.rgb.to_rgb8();
        let size = [print.width(), print.height()];
        let placement = pictures.placement(&shown.record.outcome, shown.scale, size)?;
        let title = ScanTitle {
            pair: &view.record.pair.id,
            metric: shown.fields.metric,
        };
        let mesh = {
            // The lock guards no data, so a panic of another thread does not matter.
            let _reading = locked(&self.reading);
            pictures.mesh()?.welded()
        };
        let files = ScanFiles::new(mesh, &placement, &print, &title)
            .map_err(|error| PictureError::Unencodable(error.to_string()))?;
        let [matrix, project] = [files.matrix, files.project].map(String::into_bytes);
        Ok(vec![files.ply, files.glb, matrix, project])
    }
}
