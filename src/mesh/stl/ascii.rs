//! ASCII STL: nested keywords, one a line.

use crate::mesh::error::{self, MeshError, MeshLimits};
use crate::mesh::text;
use crate::mesh::triangle_mesh::Mesh;

/// Name in messages.
const FORMAT: &str = "ascii STL";

/// Reads an ASCII STL of one or more solids; loops of more than three corners become fans.
pub(crate) fn read_ascii(bytes: &[u8], limits: &MeshLimits) -> Result<Mesh, MeshError> {
    let mut parser = AsciiParser::default();
    for (line, content) in text::lines(bytes) {
        parser
            .line(content, limits)
            .map_err(|reason| reason.into_mesh_error(line))?;
    }
    if parser.scope != Scope::File {
        return Err(MeshError::EndMissing {
            format: FORMAT,
            have: parser.facets,
            missing: parser.scope.end_keyword(),
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

impl Scope {
    const fn end_keyword(self) -> &'static str {
        match self {
            Self::File => "an end",
            Self::Solid => "endsolid",
            Self::Facet => "endfacet",
        }
    }
}

/// An error of a line whose number is not known yet, or a complete error.
enum LineError {
    Syntax(String),
    Mesh(MeshError),
}

impl LineError {
    fn into_mesh_error(self, line: u64) -> MeshError {
        match self {
            Self::Syntax(reason) => MeshError::Line { line, reason },
            Self::Mesh(error) => error,
        }
    }
}

#[derive(Default)]
struct AsciiParser {
    scope: Scope,
    facets: u64,
    /// Vertices parsed, including those of incomplete loops.
    corners: u64,
    loop_corners: Vec<[f64; 3]>,
    vertices: Vec<[f64; 3]>,
}

impl AsciiParser {
    fn line(&mut self, line: &[u8], limits: &MeshLimits) -> Result<(), LineError> {
        let mut words = text::words(line);
        let Some(keyword) = words.next() else {
            return Ok(());
        };
        match keyword.to_ascii_lowercase().as_slice() {
            b"vertex" => self.vertex(text::position(words).map_err(LineError::Syntax)?),
            b"solid" => self.transition(Scope::File, Scope::Solid, keyword),
            b"facet" => self.transition(Scope::Solid, Scope::Facet, keyword),
            b"outer" | b"endloop" => Ok(()),
            b"endfacet" => {
                self.transition(Scope::Facet, Scope::Solid, keyword)?;
                self.end_facet(limits).map_err(LineError::Mesh)
            }
            b"endsolid" => self.transition(Scope::Solid, Scope::File, keyword),
            _ => Err(LineError::Syntax(format!(
                "{} is not a word of ascii STL",
                text::quote(keyword)
            ))),
        }
    }

    fn transition(&mut self, from: Scope, to: Scope, keyword: &[u8]) -> Result<(), LineError> {
        if self.scope != from {
            return Err(LineError::Syntax(format!(
                "{} stands where it must not",
                text::quote(keyword)
            )));
        }
        self.scope = to;
        Ok(())
    }

    fn vertex(&mut self, position: [f64; 3]) -> Result<(), LineError> {
        if self.scope != Scope::Facet {
            return Err(LineError::Syntax("a vertex outside of a facet".into()));
        }
        self.corners += 1;
        let corner = error::check_finite(position, self.corners).map_err(LineError::Mesh)?;
        self.loop_corners.push(corner);
        Ok(())
    }

    fn end_facet(&mut self, limits: &MeshLimits) -> Result<(), MeshError> {
        self.facets += 1;
        if let [first, rest @ ..] = self.loop_corners.as_slice() {
            for pair in rest.windows(2) {
                self.vertices.extend([*first, pair[0], pair[1]]);
            }
        }
        self.loop_corners.clear();
        limits.check_triangles(self.vertices.len() as u64 / 3)?;
        limits.check_vertices(self.vertices.len() as u64)
    }
}
