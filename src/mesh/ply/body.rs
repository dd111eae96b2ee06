//! The rows of a PLY body into a mesh.

use super::super::{Mesh, MeshError, MeshLimits, Vertices, error, text};
use super::header::{Element, Header, Scalar, Shape};
use super::source::{NoNumber, Source};
use crate::page_vec::PageVec;

/// Names under which programs write a face's corners.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Rows that are read at a time.
const FEW: usize = 256;

/// Reads all elements in the order of the header.
pub(super) fn read(
    header: &Header,
    source: impl Source,
    limits: &MeshLimits,
) -> Result<Mesh, MeshError> {
    let vertices = header.rows("vertex");
    let mut body = Body {
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

struct Body<'a, S> {
    header: &'a Header,
    source: S,
    limits: &'a MeshLimits,
    declared_vertices: u64,
    mesh: Mesh,
    /// The values of the vertex in hand.
    row: Vec<f64>,
}

impl<S: Source> Body<'_, S> {
    fn element(&mut self, element: &Element) -> Result<(), MeshError> {
        // Rows without properties have no bytes, however many are declared; a vertex without is an error.
        let is_vertex = element.name == "vertex";
        if element.rows == 0 || (element.properties.is_empty() && !is_vertex) {
            return Ok(());
        }
        self.check_rows(element)?;
        match element.name.as_str() {
            "vertex" => self.vertices(element),
            "face" => self.faces(element, Joining::Fan),
            "tristrips" => self.faces(element, Joining::Strips),
            _ => self.skip_rows(element),
        }
    }

    /// Whether the bytes that are left can hold the rows, before memory is reserved for them.
    fn check_rows(&self, element: &Element) -> Result<(), MeshError> {
        match element.name.as_str() {
            "vertex" => self.limits.check_vertices(self.declared_vertices)?,
            "face" => self.limits.check_triangles(element.rows)?,
            _ => {}
        }
        let most = self.source.most_rows(element);
        if most < element.rows && element.fixed_size().is_some() {
            return Err(self.truncated(element, most));
        }
        Ok(())
    }

    fn truncated(&self, element: &Element, have: u64) -> MeshError {
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

    /// The error of a row counted from 0.
    fn no_number(&self, element: &Element, row: u64, reason: NoNumber) -> MeshError {
        match reason {
            NoNumber::End => self.truncated(element, row),
            NoNumber::Word(reason) => wrong_row(element, row, reason),
        }
    }

    fn vertices(&mut self, element: &Element) -> Result<(), MeshError> {
        let mut places = [0; 3];
        for (place, name) in places.iter_mut().zip(["x", "y", "z"]) {
            *place = element.place(&[name]).ok_or_else(|| {
                MeshError::Header(format!("element \"vertex\" has no property {name:?}"))
            })?;
        }
        let most = self.source.most_rows(element).min(element.rows) as usize;
        if self.mesh.vertices.is_empty() {
            self.mesh.vertices = if self.header.has_single_vertices() {
                Vertices::Single(PageVec::with_capacity(most))
            } else {
                Vertices::Double(PageVec::with_capacity(most))
            };
        }
        let plain = if element.is_plain_position() && places == [0, 1, 2] {
            self.plain_vertices(element.rows)?
        } else {
            0
        };
        for row in plain..element.rows {
            self.values(element)
                .map_err(|reason| self.no_number(element, row, reason))?;
            let count = self.mesh.vertices.len() as u64 + 1;
            let position = error::finite(places.map(|place| self.row[place]), count)?;
            match &mut self.mesh.vertices {
                Vertices::Single(vertices) => vertices.push(position.map(|v| v as f32)),
                Vertices::Double(vertices) => vertices.push(position),
            }
        }
        Ok(())
    }

    /// Reads up to so many positions that are written as most programs do, and says how many.
    fn plain_vertices(&mut self, rows: u64) -> Result<u64, MeshError> {
        let mut few = Vec::with_capacity(FEW);
        let mut row = 0;
        while row < rows {
            few.clear();
            let most = (rows - row).min(FEW as u64) as usize;
            self.source.plain_positions(most, &mut few);
            if few.is_empty() {
                return Ok(row);
            }
            error::all_finite(&few, self.mesh.vertices.len())?;
            match &mut self.mesh.vertices {
                Vertices::Single(vertices) => vertices.extend_from_slice(&few),
                Vertices::Double(vertices) => {
                    vertices.extend(few.iter().map(|v| v.map(f64::from)));
                }
            }
            row += few.len() as u64;
        }
        Ok(rows)
    }

    /// Reads a row into `self.row`, one value a property; a list counts as 0.
    fn values(&mut self, element: &Element) -> Result<(), NoNumber> {
        self.row.clear();
        for property in &element.properties {
            let value = match property.shape {
                Shape::One(kind) => self.source.next(kind)?,
                Shape::List { .. } => {
                    self.skip(property.shape)?;
                    0.0
                }
            };
            self.row.push(value);
        }
        Ok(())
    }

    fn skip(&mut self, shape: Shape) -> Result<(), NoNumber> {
        match shape {
            Shape::One(kind) => self.source.skip(kind, 1),
            Shape::List { count, item } => {
                let length = length(self.source.next(count)?)?;
                self.source.skip(item, length)
            }
        }
    }

    fn skip_rows(&mut self, element: &Element) -> Result<(), MeshError> {
        for row in 0..element.rows {
            for property in &element.properties {
                self.skip(property.shape)
                    .map_err(|reason| self.no_number(element, row, reason))?;
            }
        }
        Ok(())
    }

    fn faces(&mut self, element: &Element, joining: Joining) -> Result<(), MeshError> {
        let corners = element.place(&CORNERS).ok_or_else(|| {
            MeshError::Header(format!(
                "element {:?} has no property \"vertex_indices\"",
                element.name
            ))
        })?;
        let plain = element.plain_corners().filter(|_| joining == Joining::Fan);
        let most = self.source.most_rows(element).min(element.rows);
        if plain.is_some() && self.mesh.triangles.is_empty() {
            self.mesh.triangles = PageVec::with_capacity(most as usize);
        }
        let mut few = Vec::with_capacity(FEW);
        let mut row = 0;
        while row < element.rows {
            few.clear();
            if plain.is_some() {
                let most = (element.rows - row).min(FEW as u64) as usize;
                self.source.plain_triangles(most, &mut few);
            }
            if let Some(item) = plain
                && !few.is_empty()
            {
                self.plain_triangles(element, row, item, &few)?;
                row += few.len() as u64;
            } else {
                self.face(element, row, corners, joining)?;
                row += 1;
            }
        }
        Ok(())
    }

    /// Takes triangles as most programs write them.
    fn plain_triangles(
        &mut self,
        element: &Element,
        first_row: u64,
        item: Scalar,
        few: &[[u32; 3]],
    ) -> Result<(), MeshError> {
        let declared = self.declared_vertices;
        let corners = few.as_flattened().iter();
        let is_sound = corners.fold(true, |sound, index| sound & (u64::from(*index) < declared));
        let count = (self.mesh.triangles.len() + few.len()) as u64;
        if is_sound && self.limits.check_triangles(count).is_ok() {
            self.mesh.triangles.extend_from_slice(few);
            return Ok(());
        }
        // One by one, to tell which is wrong.
        for (row, triangle) in (first_row..).zip(few) {
            self.plain_triangle(element, row, item, *triangle)?;
        }
        Ok(())
    }

    /// Takes a triangle as most programs write it.
    fn plain_triangle(
        &mut self,
        element: &Element,
        row: u64,
        item: Scalar,
        triangle: [u32; 3],
    ) -> Result<(), MeshError> {
        for index in triangle {
            if u64::from(index) >= self.declared_vertices {
                let negative = f64::from(index.cast_signed());
                let index = if item == Scalar::I32 {
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
        element: &Element,
        row: u64,
        corners: usize,
        joining: Joining,
    ) -> Result<(), MeshError> {
        for (place, property) in element.properties.iter().enumerate() {
            match property.shape {
                Shape::List { count, item } if place == corners => {
                    self.corners(element, row, (count, item), joining)?;
                }
                other => self
                    .skip(other)
                    .map_err(|reason| self.no_number(element, row, reason))?,
            }
        }
        Ok(())
    }

    /// Reads a list of corners into triangles, one by one, so that no list is longer in memory than the limit.
    fn corners(
        &mut self,
        element: &Element,
        row: u64,
        (count, item): (Scalar, Scalar),
        joining: Joining,
    ) -> Result<(), MeshError> {
        let length = self.source.next(count).and_then(length);
        let length = length.map_err(|reason| self.no_number(element, row, reason))?;
        let mut joined = Joined::default();
        for _ in 0..length {
            let index = self.source.next(item);
            let index = index.map_err(|reason| self.no_number(element, row, reason))?;
            if joining == Joining::Strips && index == -1.0 {
                joined = Joined::default();
                continue;
            }
            self.check_index(element, row, index)?;
            if let Some(triangle) = joined.corner(index as u32, joining) {
                self.push(triangle)?;
            }
        }
        Ok(())
    }

    fn check_index(&self, element: &Element, row: u64, index: f64) -> Result<(), MeshError> {
        if index >= 0.0 && index < self.declared_vertices as f64 && index.fract() == 0.0 {
            return Ok(());
        }
        if index.fract() != 0.0 {
            return Err(wrong_row(
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

/// How a row's corners make triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Joining {
    /// A polygon as a fan around its first corner.
    Fan,
    /// Strips laid end to end with -1 between; every other triangle is wound the other way.
    Strips,
}

/// The corners that the next one makes a triangle with.
#[derive(Debug, Default)]
struct Joined {
    kept: [u32; 2],
    seen: u64,
}

impl Joined {
    /// Takes the next corner; gives the triangle that it closes.
    fn corner(&mut self, corner: u32, joining: Joining) -> Option<[u32; 3]> {
        let [a, b] = self.kept;
        let before = self.seen;
        self.seen += 1;
        self.kept = match joining {
            _ if before == 0 => [corner; 2],
            _ if before == 1 => [a, corner],
            Joining::Fan => [a, corner],
            Joining::Strips => [b, corner],
        };
        let turned = joining == Joining::Strips && before % 2 == 1;
        (before >= 2).then_some(if turned {
            [b, a, corner]
        } else {
            [a, b, corner]
        })
    }
}

/// A list's length; a negative or broken one is taken for a damaged body.
fn length(count: f64) -> Result<u64, NoNumber> {
    if count >= 0.0 && count.fract() == 0.0 {
        Ok(count as u64)
    } else {
        Err(NoNumber::Word(format!(
            "{count} is not the length of a list"
        )))
    }
}

fn wrong_row(element: &Element, row: u64, reason: String) -> MeshError {
    MeshError::Row {
        element: text::sanitize(&element.name),
        row: row + 1,
        reason,
    }
}
