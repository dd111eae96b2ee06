//! The rows of a PLY body into a mesh.

use super::super::{Error, Limits, Mesh, error};
use super::header::{Element, Header, Shape};
use super::source::{NoNumber, Source};

/// Names under which programs write a face's corners.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Reads all elements in the order of the header.
pub(super) fn read(header: &Header, source: impl Source, limits: &Limits) -> Result<Mesh, Error> {
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
    limits: &'a Limits,
    declared_vertices: u64,
    mesh: Mesh,
    /// The list or the values of the row in hand.
    row: Vec<f64>,
}

impl<S: Source> Body<'_, S> {
    fn element(&mut self, element: &Element) -> Result<(), Error> {
        // Rows without properties have no bytes, however many are declared.
        if element.rows == 0 || element.properties.is_empty() {
            return Ok(());
        }
        self.check_rows(element)?;
        match element.name.as_str() {
            "vertex" => self.vertices(element),
            "face" => self.faces(element, Body::fan),
            "tristrips" => self.faces(element, Body::strips),
            _ => self.skip_rows(element),
        }
    }

    /// Whether the bytes that are left can hold the rows, before memory is reserved for them.
    fn check_rows(&self, element: &Element) -> Result<(), Error> {
        match element.name.as_str() {
            "vertex" => self.limits.check_vertices(element.rows)?,
            "face" => self.limits.check_triangles(element.rows)?,
            _ => {}
        }
        let most = self.source.most_rows(element);
        if most < element.rows && element.fixed_size().is_some() {
            return Err(self.truncated(element, most));
        }
        Ok(())
    }

    fn truncated(&self, element: &Element, have: u64) -> Error {
        Error::Truncated {
            format: self.header.encoding.name(),
            what: match element.name.as_str() {
                "vertex" => "vertices".into(),
                "face" => "faces".into(),
                other => format!("rows of {other}"),
            },
            have,
            want: element.rows,
        }
    }

    /// The error of a row counted from 0.
    fn no_number(&self, element: &Element, row: u64, reason: NoNumber) -> Error {
        match reason {
            NoNumber::End => self.truncated(element, row),
            NoNumber::Word(reason) => wrong_row(element, row, reason),
        }
    }

    fn vertices(&mut self, element: &Element) -> Result<(), Error> {
        let mut places = [0; 3];
        for (place, name) in places.iter_mut().zip(["x", "y", "z"]) {
            *place = element.place(&[name]).ok_or_else(|| {
                Error::Header(format!("element \"vertex\" has no property {name:?}"))
            })?;
        }
        let most = self.source.most_rows(element).min(element.rows);
        self.mesh.vertices.reserve_exact(most as usize);
        for row in 0..element.rows {
            self.values(element)
                .map_err(|reason| self.no_number(element, row, reason))?;
            let position = places.map(|place| self.row[place]);
            let count = self.mesh.vertices.len() as u64 + 1;
            self.mesh.vertices.push(error::finite(position, count)?);
        }
        Ok(())
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

    fn skip_rows(&mut self, element: &Element) -> Result<(), Error> {
        for row in 0..element.rows {
            for property in &element.properties {
                self.skip(property.shape)
                    .map_err(|reason| self.no_number(element, row, reason))?;
            }
        }
        Ok(())
    }

    fn faces(
        &mut self,
        element: &Element,
        add: impl Fn(&mut Self, &Element, u64) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let corners = element.place(&CORNERS).ok_or_else(|| {
            Error::Header(format!(
                "element {:?} has no property \"vertex_indices\"",
                element.name
            ))
        })?;
        for row in 0..element.rows {
            self.face_row(element, corners)
                .map_err(|reason| self.no_number(element, row, reason))?;
            add(self, element, row)?;
            self.limits
                .check_triangles(self.mesh.triangles.len() as u64)?;
        }
        Ok(())
    }

    /// Reads a row's corners into `self.row`.
    fn face_row(&mut self, element: &Element, corners: usize) -> Result<(), NoNumber> {
        for (place, property) in element.properties.iter().enumerate() {
            match property.shape {
                Shape::List { count, item } if place == corners => {
                    let length = length(self.source.next(count)?)?;
                    self.row.clear();
                    for _ in 0..length {
                        self.row.push(self.source.next(item)?);
                    }
                }
                other => self.skip(other)?,
            }
        }
        Ok(())
    }

    /// A polygon as a fan around its first corner.
    fn fan(&mut self, element: &Element, row: u64) -> Result<(), Error> {
        for at in 0..self.row.len() {
            self.check_index(element, row, self.row[at])?;
        }
        if let [first, rest @ ..] = self.row.as_slice() {
            let fan = rest
                .windows(2)
                .map(|pair| [*first, pair[0], pair[1]].map(|index| index as u32));
            self.mesh.triangles.extend(fan);
        }
        Ok(())
    }

    /// Strips of triangles laid end to end with -1 between; every other triangle is wound the other way.
    fn strips(&mut self, element: &Element, row: u64) -> Result<(), Error> {
        let mut start = 0;
        for at in 0..self.row.len() {
            if self.row[at] == -1.0 {
                start = at + 1;
                continue;
            }
            self.check_index(element, row, self.row[at])?;
            if at >= start + 2 {
                let [a, b, c] = [at - 2, at - 1, at].map(|i| self.row[i] as u32);
                let turned = (at - start) % 2 == 1;
                self.mesh
                    .triangles
                    .push(if turned { [b, a, c] } else { [a, b, c] });
            }
        }
        Ok(())
    }

    fn check_index(&self, element: &Element, row: u64, index: f64) -> Result<(), Error> {
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
        Err(Error::IndexOutOfRange {
            face: row + 1,
            index: index as i64,
            vertices: self.declared_vertices,
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

fn wrong_row(element: &Element, row: u64, reason: String) -> Error {
    Error::Row {
        element: element.name.clone(),
        row: row + 1,
        reason,
    }
}
