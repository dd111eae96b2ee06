//! ASCII STL: nested keywords.

use crate::domain::cancel::polled;
use crate::mesh::error::{MeshError, MeshLimits};
use crate::mesh::text;
use crate::mesh::triangle_mesh::Mesh;
use crate::mesh::xyz::is_comment;

/// Reads an ASCII STL with one or more solids, and comments between them. A line may have several keywords. Loops of more
/// than three corners are triangulated as fans.
pub(crate) fn read_ascii(bytes: &[u8], limits: &MeshLimits) -> Result<Mesh, MeshError> {
    text::check_lines(bytes)?;
    let mut parser = AsciiParser::default();
    for (line, content) in text::lines(bytes) {
        if parser.scope == Scope::File && is_comment(content) {
            continue;
        }
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

/// A keyword, by what the parser does.
#[derive(Debug, Clone, Copy)]
enum Keyword {
    Solid,
    Facet,
    Vertex,
    EndFacet,
    EndSolid,
    /// Nothing follows from it.
    Other,
}

impl Keyword {
    /// Returns the keyword that a word is or begins, as in `end loop`.
    fn of<'a>(word: &[u8], words: &mut impl Iterator<Item = &'a [u8]>) -> Option<Self> {
        let (is_end, scope) = match word.split_at_checked(3) {
            Some((end, scope)) if is(end, "end") => (true, scope),
            _ => (false, word),
        };
        let scope = if scope.is_empty() {
            words.next()?
        } else {
            scope
        };
        match scope.len() {
            4 if is(scope, "loop") => Some(Self::Other),
            5 if is(scope, "facet") => Some(if is_end { Self::EndFacet } else { Self::Facet }),
            5 if is(scope, "solid") => Some(if is_end { Self::EndSolid } else { Self::Solid }),
            5 if is(scope, "outer") && !is_end => Some(Self::Other),
            6 if is(scope, "normal") && !is_end => Some(Self::Other),
            6 if is(scope, "vertex") && !is_end => Some(Self::Vertex),
            _ => None,
        }
    }
}

fn is(word: &[u8], name: &str) -> bool {
    word.eq_ignore_ascii_case(name.as_bytes())
}

/// Returns the part of a line with `solid` from `facet normal` on. Without it, all words are the name.
fn after_name(line: &[u8]) -> &[u8] {
    let starts = |at: &usize| {
        let (before, rest) = line.split_at(*at);
        let Some((word, rest)) = rest.split_at_checked("facet".len()) else {
            return false;
        };
        before.last().is_some_and(u8::is_ascii_whitespace)
            && is(word, "facet")
            && text::words(rest)
                .next()
                .is_some_and(|word| is(word, "normal"))
    };
    let start = polled(0..line.len()).find(starts);
    start.map_or(&[], |at| &line[at..])
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
    loop_corners: Vec<[f64; 3]>,
    vertices: Vec<[f64; 3]>,
}

impl AsciiParser {
    fn parse(&mut self, line: &[u8], limits: &MeshLimits) -> Result<(), MeshError> {
        let mut words = text::words(line);
        let mut is_first = true;
        while let Some(word) = words.next() {
            // A number of a normal, or one after a position.
            let is_number = matches!(word[0], b'0'..=b'9' | b'+' | b'-' | b'.');
            if is_number && !is_first {
                continue;
            }
            match Keyword::of(word, &mut words) {
                Some(Keyword::Vertex) => {
                    let position = text::position(&mut words);
                    self.vertex(position.map_err(|reason| self.fault(reason))?)?;
                }
                Some(Keyword::Other) => {}
                Some(Keyword::Facet) => self.transition(Scope::Solid, Scope::Facet, word)?,
                Some(Keyword::EndFacet) => {
                    self.transition(Scope::Facet, Scope::Solid, word)?;
                    self.end_facet(limits)?;
                }
                Some(Keyword::Solid) => {
                    self.transition(Scope::File, Scope::Solid, word)?;
                    return self.parse(after_name(line), limits);
                }
                Some(Keyword::EndSolid) => {
                    return self.transition(Scope::Solid, Scope::File, word);
                }
                None if !is_first && text::number(word).is_some() => {}
                None => {
                    let word = text::quote(word);
                    return Err(self.fault(format!("{word} is not a word of ascii STL")));
                }
            }
            is_first = false;
        }
        Ok(())
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
        self.loop_corners.push(position);
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
