//! Reads the rows of a PLY body into a mesh.

use super::header::{PlyElement, PlyHeader, PlyScalar, PlyType};
use super::source::{BodyFault, NumberSource};
use crate::domain::cancel::{PollCounter, polled};
use crate::mesh::error::{MeshError, MeshLimits};
use crate::mesh::missing::PositionCheck;
use crate::mesh::text;
use crate::mesh::triangle_mesh::{Mesh, Vertices};
use crate::page_vec::PageVec;

/// Names of the property with a face's corners.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Rows that are read at a time.
const CHUNK_ROWS: usize = 256;

/// What the rows of a body define.
pub(super) struct PlyBody {
    pub(super) mesh: Mesh,
    pub(super) check: PositionCheck,
    /// Number of faces with fewer than three corners, which are left out.
    pub(super) incomplete_faces: u64,
    /// White space and zeros after the last row, bytes.
    pub(super) padding: usize,
}

/// Reads all elements in the order of the header.
pub(super) fn read(
    header: &PlyHeader,
    source: impl NumberSource,
    limits: &MeshLimits,
) -> Result<PlyBody, MeshError> {
    let mut body = BodyReader {
        header,
        source,
        limits,
        declared_vertices: header.rows("vertex"),
        mesh: Mesh::default(),
        check: PositionCheck::NONE,
        incomplete_faces: 0,
        row: 0,
        counter: PollCounter::default(),
    };
    for element in &header.elements {
        body.element(element)?;
    }
    // Some programs end the file with a line break or fill its last block.
    let is_padding = |byte: &u8| byte.is_ascii_whitespace() || *byte == 0;
    let rest = body.source.rest();
    if !polled(rest).all(is_padding) {
        return Err(MeshError::BytesAfterRows {
            format: header.encoding.name(),
            bytes: rest.len() as u64,
        });
    }
    Ok(PlyBody {
        padding: rest.len(),
        mesh: body.mesh,
        check: body.check,
        incomplete_faces: body.incomplete_faces,
    })
}

struct BodyReader<'a, S> {
    header: &'a PlyHeader,
    source: S,
    limits: &'a MeshLimits,
    declared_vertices: u64,
    mesh: Mesh,
    check: PositionCheck,
    incomplete_faces: u64,
    /// Complete rows of the current element.
    row: u64,
    counter: PollCounter,
}

impl<S: NumberSource> BodyReader<'_, S> {
    fn element(&mut self, element: &PlyElement) -> Result<(), MeshError> {
        // Rows without properties take no bytes, so they need not be read. Vertices without properties are an error.
        if element.rows == 0 || (element.properties.is_empty() && element.name != "vertex") {
            return Ok(());
        }
        self.check_rows(element)?;
        self.row = 0;
        let read = match element.name.as_str() {
            "vertex" => self.vertices(element),
            "face" => self.faces(element, FaceKind::Polygon),
            "tristrips" => self.faces(element, FaceKind::Strips),
            _ => self.skip_rows(element),
        };
        read.map_err(|fault| match fault {
            BodyFault::End => self.truncated(element, self.row),
            BodyFault::Invalid(reason) => MeshError::Row {
                element: text::sanitize(&element.name),
                row: self.row + 1,
                reason,
            },
            BodyFault::Mesh(error) => error,
        })
    }

    /// Checks the declared rows against the limits and the remaining bytes, before memory is reserved for the rows.
    fn check_rows(&self, element: &PlyElement) -> Result<(), MeshError> {
        match element.name.as_str() {
            "vertex" => self.limits.check_vertices(self.declared_vertices)?,
            "face" => self.limits.check_triangles(element.rows)?,
            _ => {}
        }
        let most = self.source.max_rows(element);
        if most < element.rows && element.fixed_size().is_some() {
            return Err(self.truncated(element, most));
        }
        Ok(())
    }

    fn truncated(&self, element: &PlyElement, have: u64) -> MeshError {
        MeshError::Truncated {
            format: self.header.encoding.name(),
            what: match element.name.as_str() {
                "vertex" => "vertices".into(),
                "face" => "faces".into(),
                other => format!("rows of {}", text::sanitize(other)),
            },
            have,
            want: element.rows,
        }
    }

    fn vertices(&mut self, element: &PlyElement) -> Result<(), BodyFault> {
        let mut columns = [0; 3];
        for (column, name) in columns.iter_mut().zip(["x", "y", "z"]) {
            *column = element.position_of(&[name]).ok_or_else(|| {
                MeshError::Header(format!("element \"vertex\" has no property {name:?}"))
            })?;
        }
        let most = self.source.max_rows(element).min(element.rows) as usize;
        if self.mesh.vertices.is_empty() {
            self.mesh.vertices = if self.header.has_single_vertices() {
                Vertices::Single(PageVec::with_capacity(most))
            } else {
                Vertices::Double(PageVec::with_capacity(most))
            };
        }
        if element.is_packed_position() && columns == [0, 1, 2] {
            self.packed_vertices(element.rows);
        }
        while self.row < element.rows {
            self.counter.tick();
            let position = self.position(element, columns)?;
            self.check.add(&[position]);
            match &mut self.mesh.vertices {
                Vertices::Single(vertices) => vertices.push(position.map(|v| v as f32)),
                Vertices::Double(vertices) => vertices.push(position),
            }
            self.row += 1;
        }
        Ok(())
    }

    /// Reads rows of exactly three 32-bit floats, the most common layout, in blocks. Stops if the source returns no
    /// rows; the caller then reads the remaining rows one by one.
    fn packed_vertices(&mut self, rows: u64) {
        let mut chunk = Vec::with_capacity(CHUNK_ROWS);
        while self.row < rows {
            self.counter.add(CHUNK_ROWS as u32);
            let most = (rows - self.row).min(CHUNK_ROWS as u64) as usize;
            self.source.packed_positions(most, &mut chunk);
            if chunk.is_empty() {
                break;
            }
            self.check.add(&chunk);
            match &mut self.mesh.vertices {
                Vertices::Single(vertices) => vertices.extend_from_slice(&chunk),
                Vertices::Double(vertices) => {
                    vertices.extend(chunk.iter().map(|v| v.map(f64::from)));
                }
            }
            self.row += chunk.len() as u64;
        }
    }

    /// Reads a row of vertices, whose coordinates are in the given columns; a list counts as 0.
    fn position(
        &mut self,
        element: &PlyElement,
        columns: [usize; 3],
    ) -> Result<[f64; 3], BodyFault> {
        let mut position = [0.0; 3];
        for (column, property) in element.properties.iter().enumerate() {
            let axis = columns.iter().position(|of_axis| *of_axis == column);
            match (property.shape, axis) {
                (PlyType::Scalar(kind), Some(axis)) => position[axis] = self.source.next(kind)?,
                (other, _) => self.skip(other)?,
            }
        }
        Ok(position)
    }

    fn skip(&mut self, shape: PlyType) -> Result<(), BodyFault> {
        match shape {
            PlyType::Scalar(kind) => self.source.skip(kind, 1),
            PlyType::List { count, item } => {
                let length = self.list_length(count)?;
                self.source.skip(item, length)
            }
        }
    }

    /// Reads the length of a list. Returns a fault if the length is negative or not a whole number.
    fn list_length(&mut self, kind: PlyScalar) -> Result<u64, BodyFault> {
        let length = self.source.next(kind)?;
        let whole = length as u64;
        if whole as f64 == length {
            return Ok(whole);
        }
        let reason = format!("{length} is not the length of a list");
        Err(BodyFault::Invalid(reason))
    }

    fn skip_rows(&mut self, element: &PlyElement) -> Result<(), BodyFault> {
        while self.row < element.rows {
            self.counter.tick();
            for property in &element.properties {
                self.skip(property.shape)?;
            }
            self.row += 1;
        }
        Ok(())
    }

    fn faces(&mut self, element: &PlyElement, kind: FaceKind) -> Result<(), BodyFault> {
        let corners = element.position_of(&CORNERS).ok_or_else(|| {
            let name = &element.name;
            MeshError::Header(format!(
                "element {name:?} has no property \"vertex_indices\""
            ))
        })?;
        let packed = element
            .packed_corner_type()
            .filter(|_| kind == FaceKind::Polygon);
        let most = self.source.max_rows(element).min(element.rows);
        if packed.is_some() && self.mesh.triangles.is_empty() {
            self.mesh.triangles = PageVec::with_capacity(most as usize);
        }
        let mut chunk = Vec::with_capacity(CHUNK_ROWS);
        while self.row < element.rows {
            self.counter.add(CHUNK_ROWS as u32);
            chunk.clear();
            if packed.is_some() {
                let most = (element.rows - self.row).min(CHUNK_ROWS as u64) as usize;
                self.source.packed_triangles(most, &mut chunk);
            }
            if let Some(item) = packed
                && !chunk.is_empty()
            {
                self.packed_triangles(item, &chunk)?;
            } else {
                self.face(element, corners, kind)?;
                self.row += 1;
            }
        }
        Ok(())
    }

    /// Appends triangles that were read in the packed layout.
    fn packed_triangles(&mut self, item: PlyScalar, chunk: &[[u32; 3]]) -> Result<(), BodyFault> {
        let declared = self.declared_vertices;
        let corners = chunk.as_flattened().iter();
        let is_sound = corners.fold(true, |sound, index| sound & (u64::from(*index) < declared));
        let count = (self.mesh.triangles.len() + chunk.len()) as u64;
        if is_sound && self.limits.check_triangles(count).is_ok() {
            self.mesh.triangles.extend_from_slice(chunk);
            self.row += chunk.len() as u64;
            return Ok(());
        }
        // Checked separately to report the faulty one.
        let is_signed = item == PlyScalar::I32;
        for triangle in chunk {
            for index in triangle {
                self.check_index(if is_signed {
                    f64::from(index.cast_signed())
                } else {
                    f64::from(*index)
                })?;
            }
            self.push(*triangle)?;
            self.row += 1;
        }
        Ok(())
    }

    fn push(&mut self, triangle: [u32; 3]) -> Result<(), MeshError> {
        let count = self.mesh.triangles.len() as u64 + 1;
        self.limits.check_triangles(count)?;
        self.mesh.triangles.push(triangle);
        Ok(())
    }

    /// Reads one row of faces; `corners` is the column with the corners.
    fn face(
        &mut self,
        element: &PlyElement,
        corners: usize,
        kind: FaceKind,
    ) -> Result<(), BodyFault> {
        for (column, property) in element.properties.iter().enumerate() {
            match property.shape {
                PlyType::List { count, item } if column == corners => {
                    self.corners(count, item, kind)?;
                }
                other => self.skip(other)?,
            }
        }
        Ok(())
    }

    /// Reads a list of corners into triangles. The list is not stored, because its length has no limit.
    fn corners(
        &mut self,
        count: PlyScalar,
        item: PlyScalar,
        kind: FaceKind,
    ) -> Result<(), BodyFault> {
        let mut joined = CornerJoiner::default();
        for _ in 0..self.list_length(count)? {
            self.counter.tick();
            let index = self.source.next(item)?;
            if kind == FaceKind::Strips && index == -1.0 {
                joined = CornerJoiner::default();
                continue;
            }
            self.check_index(index)?;
            if let Some(triangle) = joined.corner(index as u32, kind) {
                self.push(triangle)?;
            }
        }
        if kind == FaceKind::Polygon && joined.seen < 3 {
            self.incomplete_faces += 1;
        }
        Ok(())
    }

    fn check_index(&self, index: f64) -> Result<(), BodyFault> {
        if index.fract() != 0.0 {
            let reason = format!("{index} is not a vertex index");
            return Err(BodyFault::Invalid(reason));
        }
        if index >= 0.0 && index < self.declared_vertices as f64 {
            return Ok(());
        }
        Err(BodyFault::Mesh(MeshError::IndexOutOfRange {
            face: self.row + 1,
            index: index as i64,
            vertices: self.declared_vertices,
        }))
    }
}

/// How the corners of a row form triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FaceKind {
    /// A polygon, triangulated as a fan around its first corner.
    Polygon,
    /// Strips separated by -1; every other triangle has the opposite winding.
    Strips,
}

/// The corners that form a triangle with the next one.
#[derive(Debug, Default)]
struct CornerJoiner {
    kept: [u32; 2],
    seen: u64,
}

impl CornerJoiner {
    /// Adds a corner and returns the triangle that it completes.
    fn corner(&mut self, corner: u32, kind: FaceKind) -> Option<[u32; 3]> {
        let ([a, b], before) = (self.kept, self.seen);
        self.seen += 1;
        self.kept = match kind {
            _ if before == 0 => [corner; 2],
            FaceKind::Strips if before >= 2 => [b, corner],
            FaceKind::Polygon | FaceKind::Strips => [a, corner],
        };
        let is_reversed = kind == FaceKind::Strips && before % 2 == 1;
        let [a, b] = if is_reversed { [b, a] } else { [a, b] };
        (before >= 2).then_some([a, b, corner])
    }
}
