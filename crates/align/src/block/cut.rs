//! Cuts the mesh of each character out of a block.

use std::io::{self, Read, Seek, SeekFrom, Write};

use rayon::prelude::*;

use super::align::CarvedFace;
use super::bounds::bounds;
use super::characters::PlacedCharacter;
use super::relief::surface_height;
use mocban_core::domain::cancel::{ThreadToken, poll, polled};
use mocban_core::mesh::{Mesh, MeshReadError, Triangle, TriangleStream, Vertices};

/// Margin around a character's box, mm: ground for the plane and the threshold, but few strokes of neighbours.
pub const CUT_MARGIN_MM: f64 = 0.8;
/// Heights that are cut, relative to the surface under the tops, mm: no walls, no other side, no holder.
const BELOW_MM: f64 = 6.0;
const ABOVE_MM: f64 = 2.0;
/// Cells of the grid that finds the characters of a point, mm.
const CELL_MM: f64 = 0.5;
/// Largest number of cells, and of characters in all cells together.
const MAX_ENTRIES: f64 = 1.6e7;
/// Triangles in memory before they are written to the spill file.
const MAX_BUFFERED: usize = 1 << 19;
/// Triangles that one task assigns.
const TASK: usize = 8192;
/// Bytes of a triangle in the spill file.
const RECORD: usize = 9 * 8;

/// Why characters cannot be cut.
#[derive(Debug, thiserror::Error)]
pub enum CutError {
    /// The mesh cannot be read.
    #[error(transparent)]
    Mesh(#[from] MeshReadError),
    /// The temporary file cannot be written or read.
    #[error("the temporary file of the cut cannot be written or read")]
    Spill(#[source] io::Error),
    /// The result cannot be stored.
    #[error("the mesh of a character cannot be written")]
    Store(#[source] io::Error),
}

/// Which characters a point of the face belongs to.
#[derive(Debug, Clone)]
pub struct CutPlan<'a> {
    side: &'a CarvedFace,
    boxes: Vec<[f64; 4]>,
    origin_mm: [f64; 2],
    cell_mm: f64,
    columns: usize,
    /// First entry of each cell in `members`, and the end of the last one.
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl<'a> CutPlan<'a> {
    /// Plans the cut of characters.
    pub fn of(side: &'a CarvedFace, characters: &[PlacedCharacter]) -> Self {
        let grown = |[u0, v0, u1, v1]: [f64; 4]| {
            [
                u0 - CUT_MARGIN_MM,
                v0 - CUT_MARGIN_MM,
                u1 + CUT_MARGIN_MM,
                v1 + CUT_MARGIN_MM,
            ]
        };
        let boxes: Vec<[f64; 4]> = characters.iter().map(|c| grown(c.face_box)).collect();
        let [left, top, right, bottom] =
            bounds((boxes.iter()).flat_map(|[u0, v0, u1, v1]| [[*u0, *v0], [*u1, *v1]]));
        let origin_mm = [left, top];
        let cell_mm = cell_size([right - left, bottom - top], &boxes);
        let cell = |k: usize, at: f64| ((at - origin_mm[k]) / cell_mm) as usize;
        let columns = cell(0, right) + 1;
        let rows = cell(1, bottom) + 1;
        let cells_of = |[u0, v0, u1, v1]: [f64; 4]| {
            (cell(1, v0)..=cell(1, v1))
                .flat_map(move |y| (cell(0, u0)..=cell(0, u1)).map(move |x| y * columns + x))
        };
        let mut starts = vec![0_u32; columns * rows + 1];
        for at in boxes.iter().flat_map(|b| cells_of(*b)) {
            starts[at + 1] += 1;
        }
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        let mut next = starts.clone();
        let mut members = vec![0; starts[columns * rows] as usize];
        for (number, face_box) in (0..).zip(&boxes) {
            for at in cells_of(*face_box) {
                members[next[at] as usize] = number;
                next[at] += 1;
            }
        }
        Self {
            side,
            boxes,
            origin_mm,
            cell_mm,
            columns,
            starts,
            members,
        }
    }

    /// Calls `found` with each character that a triangle belongs to: the middle of the triangle lies in the box and near
    /// the surface under the tops.
    fn characters(&self, triangle: &Triangle, mut found: impl FnMut(u32)) {
        let third = |k: usize| (triangle[0][k] + triangle[1][k] + triangle[2][k]) / 3.0;
        let map = &self.side.map;
        let [u, v, n] = map.frame.face_from_mesh([third(0), third(1), third(2)]);
        let x = (u - self.origin_mm[0]) / self.cell_mm;
        let y = (v - self.origin_mm[1]) / self.cell_mm;
        if !(x >= 0.0 && y >= 0.0 && x < self.columns as f64) {
            return;
        }
        let cell = y as usize * self.columns + x as usize;
        let Some([start, end]) = self
            .starts
            .get(cell..cell + 2)
            .map(|ends| [ends[0], ends[1]])
        else {
            return;
        };
        if start == end {
            return;
        }
        let above = n - f64::from(surface_height(map, &self.side.relief.surface, [u, v]));
        if !(-BELOW_MM..=ABOVE_MM).contains(&above) {
            return;
        }
        for number in &self.members[start as usize..end as usize] {
            let [u0, v0, u1, v1] = self.boxes[*number as usize];
            if u >= u0 && u <= u1 && v >= v0 && v <= v1 {
                found(*number);
            }
        }
    }
}

/// Returns the side of the cells, mm: larger than [`CELL_MM`] if boxes overlap so often or lie so far apart that the grid
/// would be large.
fn cell_size(size_mm: [f64; 2], boxes: &[[f64; 4]]) -> f64 {
    let entries = |cell_mm: f64| {
        let cells = |width: f64, height: f64| (width / cell_mm + 2.0) * (height / cell_mm + 2.0);
        let members = boxes.iter().map(|[u0, v0, u1, v1]| cells(u1 - u0, v1 - v0));
        cells(size_mm[0], size_mm[1]) + members.sum::<f64>()
    };
    let mut cell_mm = CELL_MM;
    // With infinite cells, each box has a constant number of entries.
    while entries(cell_mm) > MAX_ENTRIES && cell_mm.is_finite() {
        cell_mm *= 2.0;
    }
    cell_mm
}

/// Triangles of characters, some of them in a temporary file.
struct Spill<'a, F> {
    file: &'a mut F,
    buffered: Vec<Vec<Triangle>>,
    count: usize,
    /// Position and number of triangles of each part in the file, by character.
    parts: Vec<Vec<(u64, usize)>>,
    end: u64,
}

impl<F: Read + Write + Seek> Spill<'_, F> {
    fn push(&mut self, number: u32, triangle: Triangle) -> io::Result<()> {
        self.buffered[number as usize].push(triangle);
        self.count += 1;
        if self.count >= MAX_BUFFERED {
            self.flush()?;
        }
        Ok(())
    }

    /// Writes all triangles in memory to the file.
    fn flush(&mut self) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(self.end))?;
        let mut bytes = Vec::new();
        for (triangles, parts) in self.buffered.iter_mut().zip(&mut self.parts) {
            if triangles.is_empty() {
                continue;
            }
            poll();
            bytes.clear();
            bytes.extend(
                triangles
                    .as_flattened()
                    .as_flattened()
                    .iter()
                    .flat_map(|v| v.to_le_bytes()),
            );
            self.file.write_all(&bytes)?;
            parts.push((self.end, triangles.len()));
            self.end += bytes.len() as u64;
            // Scans are in spatial order: a character that is filled now gets few triangles later.
            *triangles = Vec::new();
        }
        self.count = 0;
        Ok(())
    }

    /// Returns all triangles of a character, in the order of the mesh.
    fn take(&mut self, number: usize) -> io::Result<Vec<Triangle>> {
        let mut triangles = Vec::new();
        for (at, count) in std::mem::take(&mut self.parts[number]) {
            let mut bytes = vec![0; count * RECORD];
            self.file.seek(SeekFrom::Start(at))?;
            self.file.read_exact(&mut bytes)?;
            for record in polled(bytes.as_chunks::<RECORD>().0) {
                let (floats, _) = record.as_chunks::<8>();
                let float = |k: usize| f64::from_le_bytes(floats[k]);
                triangles.push([0, 3, 6].map(|k| [float(k), float(k + 1), float(k + 2)]));
            }
        }
        triangles.append(&mut self.buffered[number]);
        Ok(triangles)
    }
}

/// Cuts the meshes of all characters in one pass over the mesh of the block. Calls `store` with each character's index
/// and mesh, in order. The mesh keeps the frame and unit of the block. `spill` is an empty temporary file; memory does
/// not depend on the size of the scan.
///
/// # Errors
/// Returns an error if the mesh cannot be read, or the temporary file or a result cannot be written.
pub fn cut_meshes(
    mesh: &mut dyn TriangleStream,
    plan: &CutPlan<'_>,
    spill: &mut (impl Read + Write + Seek),
    mut store: impl FnMut(usize, Mesh) -> io::Result<()>,
) -> Result<(), CutError> {
    let count = plan.boxes.len();
    let mut spill = Spill {
        file: spill,
        buffered: vec![Vec::new(); count],
        count: 0,
        parts: vec![Vec::new(); count],
        end: 0,
    };
    let token = ThreadToken::current();
    let assign = |part: &[Triangle]| {
        let mut assigned = Vec::new();
        for triangle in part {
            plan.characters(triangle, |number| assigned.push((number, *triangle)));
        }
        assigned
    };
    let mut failed = None;
    let passed = mesh.pass(&mut |triangles| {
        let assigned: Vec<Vec<(u32, Triangle)>> = triangles
            .par_chunks(TASK)
            .map(|part| token.scope(|| assign(part)))
            .collect();
        for (number, triangle) in polled(assigned.into_iter().flatten()) {
            if let Err(error) = spill.push(number, triangle) {
                let kind = error.kind();
                failed = Some(error);
                return Err(io::Error::from(kind).into());
            }
        }
        Ok(())
    });
    if let Some(error) = failed {
        return Err(CutError::Spill(error));
    }
    passed?;
    for number in 0..count {
        let triangles = spill.take(number).map_err(CutError::Spill)?;
        store(number, welded(&triangles)).map_err(CutError::Store)?;
    }
    Ok(())
}

/// Joins triangles at corners with equal coordinates.
fn welded(triangles: &[Triangle]) -> Mesh {
    let corners = triangles.as_flattened();
    let is_single = corners
        .as_flattened()
        .iter()
        .all(|v| f64::from(*v as f32) == *v);
    let vertices = if is_single {
        Vertices::Single(
            corners
                .iter()
                .map(|corner| corner.map(|v| v as f32))
                .collect(),
        )
    } else {
        corners.iter().copied().collect()
    };
    Mesh::from_soup(vertices).welded()
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::super::test_world::TestWorld;
    use super::{CELL_MM, CUT_MARGIN_MM, CutPlan, cell_size, cut_meshes};
    use crate::block::{CharacterBox, PlacedCharacter};
    use mocban_core::mesh::Mesh;

    fn character(face_box: [f64; 4]) -> PlacedCharacter {
        PlacedCharacter {
            label: CharacterBox {
                name: String::new(),
                text: None,
                page_box: [0.0; 4],
            },
            face_box,
            ncc: 1.0,
            shift_mm: [0.0; 2],
            support: 1.0,
            confidence: 1.0,
        }
    }

    #[test]
    fn the_grid_stays_small_for_boxes_far_apart_or_over_each_other() {
        let apart = [[0.0; 4], [1e12, -1e9, 1e12, 1e9]];
        let over = vec![[0.0, 0.0, 345.0, 230.0]; 50_000];
        let usual: Vec<[f64; 4]> = (0..500)
            .map(|k| [f64::from(k % 25) * 13.0, f64::from(k / 25) * 10.0])
            .map(|[u, v]| [u, v, u + 12.0, v + 9.0])
            .collect();
        assert_eq!(cell_size([345.0, 230.0], &usual), CELL_MM);
        for (boxes, size) in [(&apart[..], [1e12, 2e9]), (&over[..], [345.0, 230.0])] {
            let cell_mm = cell_size(size, boxes);
            let entries = boxes
                .iter()
                .map(|[u0, v0, u1, v1]| ((u1 - u0) / cell_mm + 2.0) * ((v1 - v0) / cell_mm + 2.0));
            assert!(
                cell_mm.is_finite() && entries.sum::<f64>() < 2e7,
                "{cell_mm}"
            );
        }
    }

    /// A sheet of triangles every half millimetre over the face of a world, and the same sheet 18 mm below.
    fn sheets(tops: f64) -> Mesh {
        let (columns, rows) = (301, 201);
        let level = |height: f64| {
            (0..columns * rows).map(move |k| {
                [
                    f64::from(k % columns) * 0.5,
                    f64::from(k / columns) * 0.5,
                    height,
                ]
            })
        };
        let below = (columns * rows) as u32;
        let cells =
            (0..rows - 1).flat_map(|y| (0..columns - 1).map(move |x| (y * columns + x) as u32));
        let next = columns as u32;
        let triangles = cells.flat_map(|k| {
            [0, below].into_iter().flat_map(move |from| {
                let k = k + from;
                [[k, k + 1, k + next], [k + 1, k + next + 1, k + next]]
            })
        });
        Mesh {
            vertices: level(tops).chain(level(tops - 18.0)).collect(),
            triangles: triangles.collect(),
        }
    }

    #[test]
    fn each_character_gets_the_triangles_of_its_box_on_the_face() {
        let face = TestWorld::new(31).face();
        let tops = f64::from(super::surface_height(
            &face.map,
            &face.relief.surface,
            [75.0, 50.0],
        ));
        let mesh = sheets(tops);
        // The first two overlap with their margins; the third lies outside the scan.
        let boxes = [
            [60.0, 40.0, 70.0, 50.0],
            [71.0, 40.0, 81.0, 50.0],
            [400.0, 40.0, 410.0, 50.0],
        ];
        let characters = boxes.map(character);
        let plan = CutPlan::of(&face, &characters);
        let mut spill = Cursor::new(Vec::new());
        let mut found = Vec::new();
        cut_meshes(&mut &mesh, &plan, &mut spill, |number, mesh| {
            found.push((number, mesh));
            Ok(())
        })
        .unwrap();
        assert_eq!(
            found.iter().map(|(number, _)| *number).collect::<Vec<_>>(),
            [0, 1, 2]
        );
        assert!(found[2].1.triangles.is_empty());
        for ((_, mesh), [u0, v0, u1, v1]) in found.iter().zip(boxes).take(2) {
            let side = 10.0 + 2.0 * CUT_MARGIN_MM;
            let expected = 2.0 * (side / 0.5).powi(2);
            let count = mesh.triangles.len() as f64;
            assert!(
                (count - expected).abs() < 0.06 * expected,
                "{count} {expected}"
            );
            for vertex in mesh.vertices.iter() {
                let reach = CUT_MARGIN_MM + 0.5;
                assert!(vertex[0] > u0 - reach && vertex[0] < u1 + reach);
                assert!(vertex[1] > v0 - reach && vertex[1] < v1 + reach);
                assert_eq!(vertex[2], tops);
            }
        }
    }
}
