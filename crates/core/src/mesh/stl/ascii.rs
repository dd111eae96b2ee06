//! ASCII STL: nested keywords, one a line.

use crate::domain::cancel::polled;
use crate::mesh::error::{self, MeshError, MeshLimits};
use crate::mesh::text;
use crate::mesh::triangle_mesh::Mesh;

/// Reads an ASCII STL with one or more solids. Loops of more than three corners are triangulated as fans.
pub(crate) fn read_ascii(bytes: &[u8], limits: &MeshLimits) -> Result<Mesh, MeshError> {
    text::check_lines(bytes)?;
    let mut parser = AsciiParser::default();
    for (line, content) in text::lines(bytes) {
        parser.line = line;
        parser.parse(content, limits)?;
    }
    let missing = match parser.scope {
        Scope::File => None,
        Scope::Solid => Some("endsolid"),
        Scope::Facet => Some("endfacet"),
    };
    if let Some(missing) = missing {
        return Err(MeshError::EndMissing {
            format: "ascii STL",
            have: parser.facets,
            missing,
        });
    }
    if parser.vertices.is_empty() {
        return Err(MeshError::NoFaces);
    }
    Ok(Mesh::from_soup(parser.vertices.into()))
}

/// The scope that the parser is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Scope {
    #[default]
    File,
    Solid,
    Facet,
}

#[derive(Default)]
struct AsciiParser {
    /// Number of the current line, counted from 1.
    line: u64,
    scope: Scope,
    facets: u64,
    /// Vertices parsed, including vertices of incomplete loops.
    corners: u64,
    loop_corners: Vec<[f64; 3]>,
    vertices: Vec<[f64; 3]>,
}

impl AsciiParser {
    fn parse(&mut self, line: &[u8], limits: &MeshLimits) -> Result<(), MeshError> {
        let mut words = text::words(line);
        let Some(keyword) = words.next() else {
            return Ok(());
        };
        match keyword.to_ascii_lowercase().as_slice() {
            b"vertex" => self.vertex(text::position(words).map_err(|reason| self.fault(reason))?),
            b"solid" => self.transition(Scope::File, Scope::Solid, keyword),
            b"facet" => self.transition(Scope::Solid, Scope::Facet, keyword),
            b"outer" | b"endloop" => Ok(()),
            b"endfacet" => {
                self.transition(Scope::Facet, Scope::Solid, keyword)?;
                self.end_facet(limits)
            }
            b"endsolid" => self.transition(Scope::Solid, Scope::File, keyword),
            _ => {
                let word = text::quote(keyword);
                Err(self.fault(format!("{word} is not a word of ascii STL")))
            }
        }
    }

    fn fault(&self, reason: String) -> MeshError {
        let line = self.line;
        MeshError::Line { line, reason }
    }

    fn transition(&mut self, from: Scope, to: Scope, keyword: &[u8]) -> Result<(), MeshError> {
        if self.scope != from {
            let word = text::quote(keyword);
            return Err(self.fault(format!("{word} stands where it must not")));
        }
        self.scope = to;
        Ok(())
    }

    fn vertex(&mut self, position: [f64; 3]) -> Result<(), MeshError> {
        if self.scope != Scope::Facet {
            return Err(self.fault("a vertex outside of a facet".into()));
        }
        self.corners += 1;
        self.loop_corners
            .push(error::check_finite(position, self.corners)?);
        Ok(())
    }

    fn end_facet(&mut self, limits: &MeshLimits) -> Result<(), MeshError> {
        self.facets += 1;
        if let [first, rest @ ..] = self.loop_corners.as_slice() {
            for pair in polled(rest.windows(2)) {
                self.vertices.extend([*first, pair[0], pair[1]]);
            }
        }
        self.loop_corners.clear();
        limits.check_triangles(self.vertices.len() as u64 / 3)?;
        limits.check_vertices(self.vertices.len() as u64)
    }
}
