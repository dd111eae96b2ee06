//! Reads the rows of a PLY body into a mesh.

use super::header::{PlyElement, PlyHeader, PlyScalar, PlyType};
use super::source::{NumberError, NumberSource};
use crate::mesh::error::{self, MeshError, MeshLimits};
use crate::mesh::text;
use crate::mesh::triangle_mesh::{Mesh, Vertices};
use crate::page_vec::PageVec;

/// Property names in use for a face's corners.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Rows that are read at a time.
const CHUNK_ROWS: usize = 256;

/// Reads all elements in the order of the header.
pub(super) fn read(
    header: &PlyHeader,
    source: impl NumberSource,
    limits: &MeshLimits,
) -> Result<Mesh, MeshError> {
    let vertices = header.rows("vertex");
    let mut body = BodyReader {
        header,
        source,
        limits,
        declared_vertices: vertices,
        mesh: Mesh::default(),
        row: Vec::new(),
    };
    for element in &header.elements {
        body.element(element)?;
    }
    Ok(body.mesh)
}

struct BodyReader<'a, S> {
    header: &'a PlyHeader,
    source: S,
    limits: &'a MeshLimits,
    declared_vertices: u64,
    mesh: Mesh,
    /// Values of the current row.
    row: Vec<f64>,
}

impl<S: NumberSource> BodyReader<'_, S> {
    fn element(&mut self, element: &PlyElement) -> Result<(), MeshError> {
        // Rows without properties have no bytes, however many are declared; a vertex without properties is an error.
        let is_vertex = element.name == "vertex";
        if element.rows == 0 || (element.properties.is_empty() && !is_vertex) {
            return Ok(());
        }
        self.check_rows(element)?;
        match element.name.as_str() {
            "vertex" => self.vertices(element),
            "face" => self.faces(element, FaceKind::Polygon),
            "tristrips" => self.faces(element, FaceKind::Strips),
            _ => self.skip_rows(element),
        }
    }

    /// Checks that the remaining bytes can hold the rows, before memory is reserved for them.
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

    /// Returns the error of a row, counted from 0.
    fn number_error(&self, element: &PlyElement, row: u64, reason: NumberError) -> MeshError {
        match reason {
            NumberError::End => self.truncated(element, row),
            NumberError::Invalid(reason) => row_error(element, row, reason),
        }
    }

    fn vertices(&mut self, element: &PlyElement) -> Result<(), MeshError> {
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
        let plain = if element.is_packed_position() && columns == [0, 1, 2] {
            self.packed_vertices(element.rows)?
        } else {
            0
        };
        for row in plain..element.rows {
            self.values(element)
                .map_err(|reason| self.number_error(element, row, reason))?;
            let count = self.mesh.vertices.len() as u64 + 1;
            let position = error::check_finite(columns.map(|column| self.row[column]), count)?;
            match &mut self.mesh.vertices {
                Vertices::Single(vertices) => vertices.push(position.map(|v| v as f32)),
                Vertices::Double(vertices) => vertices.push(position),
            }
        }
        Ok(())
    }

    /// Reads up to `rows` positions in the packed layout of most programs and returns how many were read.
    fn packed_vertices(&mut self, rows: u64) -> Result<u64, MeshError> {
        let mut chunk = Vec::with_capacity(CHUNK_ROWS);
        let mut row = 0;
        while row < rows {
            chunk.clear();
            let most = (rows - row).min(CHUNK_ROWS as u64) as usize;
            self.source.packed_positions(most, &mut chunk);
            if chunk.is_empty() {
                return Ok(row);
            }
            error::check_all_finite(&chunk, self.mesh.vertices.len())?;
            match &mut self.mesh.vertices {
                Vertices::Single(vertices) => vertices.extend_from_slice(&chunk),
                Vertices::Double(vertices) => {
                    vertices.extend(chunk.iter().map(|v| v.map(f64::from)));
                }
            }
            row += chunk.len() as u64;
        }
        Ok(rows)
    }

    /// Reads a row into `self.row`, one value per property; 0 for a list.
    fn values(&mut self, element: &PlyElement) -> Result<(), NumberError> {
        self.row.clear();
        for property in &element.properties {
            let value = match property.shape {
                PlyType::Scalar(kind) => self.source.next(kind)?,
                PlyType::List { .. } => {
                    self.skip(property.shape)?;
                    0.0
                }
            };
            self.row.push(value);
        }
        Ok(())
    }

    fn skip(&mut self, shape: PlyType) -> Result<(), NumberError> {
        match shape {
            PlyType::Scalar(kind) => self.source.skip(kind, 1),
            PlyType::List { count, item } => {
                let length = length(self.source.next(count)?)?;
                self.source.skip(item, length)
            }
        }
    }

    fn skip_rows(&mut self, element: &PlyElement) -> Result<(), MeshError> {
        for row in 0..element.rows {
            for property in &element.properties {
                self.skip(property.shape)
                    .map_err(|reason| self.number_error(element, row, reason))?;
            }
        }
        Ok(())
    }

    fn faces(&mut self, element: &PlyElement, joining: FaceKind) -> Result<(), MeshError> {
        let corners = element.position_of(&CORNERS).ok_or_else(|| {
            MeshError::Header(format!(
                "element {:?} has no property \"vertex_indices\"",
                element.name
            ))
        })?;
        let plain = element
            .packed_corner_type()
            .filter(|_| joining == FaceKind::Polygon);
        let most = self.source.max_rows(element).min(element.rows);
        if plain.is_some() && self.mesh.triangles.is_empty() {
            self.mesh.triangles = PageVec::with_capacity(most as usize);
        }
        let mut chunk = Vec::with_capacity(CHUNK_ROWS);
        let mut row = 0;
        while row < element.rows {
            chunk.clear();
            if plain.is_some() {
                let most = (element.rows - row).min(CHUNK_ROWS as u64) as usize;
                self.source.packed_triangles(most, &mut chunk);
            }
            if let Some(item) = plain
                && !chunk.is_empty()
            {
                self.packed_triangles(element, row, item, &chunk)?;
                row += chunk.len() as u64;
            } else {
                self.face(element, row, corners, joining)?;
                row += 1;
            }
        }
        Ok(())
    }

    /// Appends triangles that were read in the packed layout.
    fn packed_triangles(
        &mut self,
        element: &PlyElement,
        first_row: u64,
        item: PlyScalar,
        chunk: &[[u32; 3]],
    ) -> Result<(), MeshError> {
        let declared = self.declared_vertices;
        let corners = chunk.as_flattened().iter();
        let is_sound = corners.fold(true, |sound, index| sound & (u64::from(*index) < declared));
        let count = (self.mesh.triangles.len() + chunk.len()) as u64;
        if is_sound && self.limits.check_triangles(count).is_ok() {
            self.mesh.triangles.extend_from_slice(chunk);
            return Ok(());
        }
        // Checked separately to report the faulty one.
        for (row, triangle) in (first_row..).zip(chunk) {
            self.packed_triangle(element, row, item, *triangle)?;
        }
        Ok(())
    }

    /// Appends a triangle that was read in the packed layout.
    fn packed_triangle(
        &mut self,
        element: &PlyElement,
        row: u64,
        item: PlyScalar,
        triangle: [u32; 3],
    ) -> Result<(), MeshError> {
        for index in triangle {
            if u64::from(index) >= self.declared_vertices {
                let negative = f64::from(index.cast_signed());
                let index = if item == PlyScalar::I32 {
                    negative
                } else {
                    f64::from(index)
                };
                self.check_index(element, row, index)?;
            }
        }
        self.push(triangle)
    }

    fn push(&mut self, triangle: [u32; 3]) -> Result<(), MeshError> {
        let count = self.mesh.triangles.len() as u64 + 1;
        self.limits.check_triangles(count)?;
        self.mesh.triangles.push(triangle);
        Ok(())
    }

    /// Reads one row of faces.
    fn face(
        &mut self,
        element: &PlyElement,
        row: u64,
        corners: usize,
        joining: FaceKind,
    ) -> Result<(), MeshError> {
        for (column, property) in element.properties.iter().enumerate() {
            match property.shape {
                PlyType::List { count, item } if column == corners => {
                    self.corners(element, row, (count, item), joining)?;
                }
                other => self
                    .skip(other)
                    .map_err(|reason| self.number_error(element, row, reason))?,
            }
        }
        Ok(())
    }

    /// Reads a list of corners into triangles without storing the list, so that the limit bounds memory.
    fn corners(
        &mut self,
        element: &PlyElement,
        row: u64,
        (count, item): (PlyScalar, PlyScalar),
        joining: FaceKind,
    ) -> Result<(), MeshError> {
        let length = self.source.next(count).and_then(length);
        let length = length.map_err(|reason| self.number_error(element, row, reason))?;
        let mut joined = CornerJoiner::default();
        for _ in 0..length {
            let index = self.source.next(item);
            let index = index.map_err(|reason| self.number_error(element, row, reason))?;
            if joining == FaceKind::Strips && index == -1.0 {
                joined = CornerJoiner::default();
                continue;
            }
            self.check_index(element, row, index)?;
            if let Some(triangle) = joined.corner(index as u32, joining) {
                self.push(triangle)?;
            }
        }
        Ok(())
    }

    fn check_index(&self, element: &PlyElement, row: u64, index: f64) -> Result<(), MeshError> {
        if index >= 0.0 && index < self.declared_vertices as f64 && index.fract() == 0.0 {
            return Ok(());
        }
        if index.fract() != 0.0 {
            return Err(row_error(
                element,
                row,
                format!("{index} is not a vertex index"),
            ));
        }
        Err(MeshError::IndexOutOfRange {
            face: row + 1,
            index: index as i64,
            vertices: self.declared_vertices,
        })
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
    fn corner(&mut self, corner: u32, joining: FaceKind) -> Option<[u32; 3]> {
        let [a, b] = self.kept;
        let before = self.seen;
        self.seen += 1;
        self.kept = match joining {
            _ if before == 0 => [corner; 2],
            _ if before == 1 => [a, corner],
            FaceKind::Polygon => [a, corner],
            FaceKind::Strips => [b, corner],
        };
        let turned = joining == FaceKind::Strips && before % 2 == 1;
        (before >= 2).then_some(if turned {
            [b, a, corner]
        } else {
            [a, b, corner]
        })
    }
}

/// Converts the length of a list; a negative or fractional one means a damaged body.
fn length(count: f64) -> Result<u64, NumberError> {
    if count >= 0.0 && count.fract() == 0.0 {
        Ok(count as u64)
    } else {
        Err(NumberError::Invalid(format!(
            "{count} is not the length of a list"
        )))
    }
}

fn row_error(element: &PlyElement, row: u64, reason: String) -> MeshError {
    MeshError::Row {
        element: text::sanitize(&element.name),
        row: row + 1,
        reason,
    }
}
