//! OBJ files as nearly all programs write them, in one pass over their bytes; `tobj` takes about five times as long.
//!
//! Whatever is unusual (continued lines, a word that is no number, an index that names no vertex) is left to `tobj`,
//! which reads it or stumbles over it. What is read here is read as `tobj` would have.

use super::super::{Mesh, MeshLimits, Vertices, text};
use crate::page_vec::PageVec;

/// Digits that a 64-bit mantissa surely holds, and the largest one that a float holds exactly.
const DIGITS: usize = 19;
const EXACT: u64 = 1 << 53;
/// Powers of ten that a float holds exactly. Quotients and products of two exact floats are rounded once, so they are
/// the numbers nearest to the text.
const TENS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];
/// Bytes of a file for each vertex and each triangle that room is made for beforehand: rather too little.
const BYTES_PER_VERTEX: usize = 96;
const BYTES_PER_TRIANGLE: usize = 48;

/// Reads an OBJ; `None` where anything is unusual.
pub(super) fn read(bytes: &[u8], limits: &MeshLimits) -> Option<Mesh> {
    // A file of an old Mac has carriage returns only.
    if !bytes.contains(&b'\n') && bytes.contains(&b'\r') {
        return None;
    }
    let mut vertices: PageVec<[f64; 3]> = PageVec::with_capacity(bytes.len() / BYTES_PER_VERTEX);
    let mut triangles = PageVec::with_capacity(bytes.len() / BYTES_PER_TRIANGLE);
    let mut line = Line { rest: bytes };
    while !line.rest.is_empty() {
        line.skip_space();
        match line.rest {
            [b'v', space, rest @ ..] if is_space(*space) => {
                line.rest = rest;
                vertices.push(line.position()?);
            }
            [b'f', space, rest @ ..] if is_space(*space) => {
                line.rest = rest;
                line.face(vertices.len(), &mut triangles)?;
            }
            _ => {}
        }
        line.end()?;
    }
    limits
        .check_vertices(vertices.len() as u64)
        .and_then(|()| limits.check_triangles(triangles.len() as u64))
        .ok()?;
    if !triangles.is_empty() {
        vertices = in_order_of_use(&vertices, &mut triangles)?;
    }
    Some(Mesh {
        vertices: Vertices::Double(vertices),
        triangles,
    })
}

/// What is left of a file, from somewhere in a line on.
struct Line<'a> {
    rest: &'a [u8],
}

impl Line<'_> {
    fn skip_space(&mut self) {
        while let [byte, rest @ ..] = self.rest
            && is_space(*byte)
        {
            self.rest = rest;
        }
    }

    /// Goes to the next line; `None` where this one runs on in it.
    fn end(&mut self) -> Option<()> {
        let len = self.rest.iter().position(|byte| *byte == b'\n');
        let (line, rest) = self.rest.split_at(len.unwrap_or(self.rest.len()));
        self.rest = rest.get(1..).unwrap_or_default();
        (!line.trim_ascii_end().ends_with(b"\\")).then_some(())
    }

    /// The first three words; others are weights and colours.
    fn position(&mut self) -> Option<[f64; 3]> {
        let mut position = [0.0; 3];
        for value in &mut position {
            self.skip_space();
            *value = self.number()?;
        }
        Some(position)
    }

    /// A finite number that a space or the line's end follows.
    fn number(&mut self) -> Option<f64> {
        let word = self.rest;
        let negative = word.first() == Some(&b'-');
        self.rest = &word[usize::from(negative)..];
        let mut mantissa = 0;
        let whole = self.digits(&mut mantissa);
        let mut places = 0;
        if let [b'.', rest @ ..] = self.rest {
            self.rest = rest;
            places = self.digits(&mut mantissa);
        }
        let is_plain = (1..=DIGITS).contains(&(whole + places)) && mantissa < EXACT;
        if is_plain && self.is_at_end_of_word() {
            let value = mantissa as f64 / TENS[places];
            return Some(if negative { -value } else { value });
        }
        self.rest = word;
        let len = word.iter().position(|byte| is_end_of_word(*byte));
        let (word, rest) = word.split_at(len.unwrap_or(word.len()));
        self.rest = rest;
        text::number(word).filter(|value| value.is_finite())
    }

    /// Takes digits into a number and says how many there were; more than it holds make it meaningless.
    #[inline]
    fn digits(&mut self, number: &mut u64) -> usize {
        let before = self.rest.len();
        while let [digit @ b'0'..=b'9', rest @ ..] = self.rest {
            *number = number
                .wrapping_mul(10)
                .wrapping_add(u64::from(digit - b'0'));
            self.rest = rest;
        }
        before - self.rest.len()
    }

    fn is_at_end_of_word(&self) -> bool {
        self.rest.first().is_none_or(|byte| is_end_of_word(*byte))
    }

    /// The corners of a polygon, vertices of so many until here, as a fan around its first; fewer than three are no
    /// face.
    fn face(&mut self, vertices: usize, triangles: &mut PageVec<[u32; 3]>) -> Option<()> {
        let (mut first, mut last) = (0, 0);
        for count in 0.. {
            self.skip_space();
            if let [] | [b'\n' | b'#', ..] = self.rest {
                break;
            }
            let corner = self.corner(vertices)?;
            match count {
                0 => first = corner,
                1 => {}
                _ => triangles.push([first, last, corner]),
            }
            last = corner;
        }
        Some(())
    }

    /// The place of a corner's vertex, of so many until here; its texture and normal are stepped over.
    fn corner(&mut self, vertices: usize) -> Option<u32> {
        let (negative, index) = self.index()?;
        for _ in 0..2 {
            if let [b'/', rest @ ..] = self.rest {
                self.rest = rest;
                if let Some(b'-' | b'0'..=b'9') = rest.first() {
                    self.index()?;
                }
            }
        }
        let place = if negative {
            (vertices as u64).checked_sub(index)?
        } else {
            index.checked_sub(1)?
        };
        let is_named = !negative || index > 0;
        (is_named && self.is_at_end_of_word())
            .then(|| u32::try_from(place).ok())
            .flatten()
    }

    /// A whole number: whether it is negative, and its size.
    fn index(&mut self) -> Option<(bool, u64)> {
        let negative = self.rest.first() == Some(&b'-');
        self.rest = &self.rest[usize::from(negative)..];
        let mut index = 0;
        let digits = self.digits(&mut index);
        (1..=DIGITS).contains(&digits).then_some((negative, index))
    }
}

/// White space within a line.
const fn is_space(byte: u8) -> bool {
    byte.is_ascii_whitespace() && byte != b'\n'
}

const fn is_end_of_word(byte: u8) -> bool {
    byte.is_ascii_whitespace() || byte == b'#'
}

/// The vertices that faces use, in the order of their first use, which the faces name then; `None` when one is not
/// there.
fn in_order_of_use(
    all: &[[f64; 3]],
    triangles: &mut PageVec<[u32; 3]>,
) -> Option<PageVec<[f64; 3]>> {
    const UNUSED: u32 = u32::MAX;
    let mut place_of = vec![UNUSED; all.len()];
    let mut vertices = PageVec::with_capacity(all.len());
    for index in triangles.as_flattened_mut() {
        let place = place_of.get_mut(*index as usize)?;
        if *place == UNUSED {
            *place = vertices.len() as u32;
            vertices.push(all[*index as usize]);
        }
        *index = *place;
    }
    Some(vertices)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::read_by_tobj;
    use super::read;
    use crate::mesh::{Mesh, MeshLimits};

    /// A number as programs write it, and as few do.
    fn number() -> impl Strategy<Value = String> {
        prop_oneof![
            (-1e4..1e4_f64).prop_map(|v| format!("{v:.6}")),
            any::<f64>().prop_map(|v| format!("{v}")),
            any::<f64>().prop_map(|v| format!("{v:e}")),
            any::<f32>().prop_map(|v| format!("{v}")),
            any::<i64>().prop_map(|v| format!("{v}.")),
            Just("+1.5".to_owned()),
            Just("-.25".to_owned()),
            Just("1.5E+2".to_owned()),
        ]
    }

    fn vertex() -> impl Strategy<Value = String> {
        let rest = prop_oneof![4 => Just(""), 1 => Just(" 1.0"), 1 => Just("  0.5 0.5 0.5 ")];
        let space = prop_oneof![4 => Just(" "), 1 => Just("\t  ")];
        (number(), number(), number(), rest, space)
            .prop_map(|(x, y, z, rest, space)| format!("v {x}{space}{y} {z}{rest}"))
    }

    fn face() -> impl Strategy<Value = String> {
        let corner = (-12..13_i32, 0..7).prop_map(|(v, way)| match way {
            0 => format!("{v}/1"),
            1 => format!("{v}//2"),
            2 => format!("{v}/3/-1"),
            _ => format!("{v}"),
        });
        prop::collection::vec(corner, 0..6).prop_map(|corners| format!("f {}", corners.join(" ")))
    }

    fn line() -> impl Strategy<Value = String> {
        let other = prop::sample::select(vec![
            "",
            "# v 1 2 3",
            "vn 0 0 1",
            "vt 0.5 0.5",
            "g one",
            "usemtl red",
            "s off",
            "  v 1 2 3 # a",
            "f 1 2 3#",
            "f 1 2 3 \\",
            "v 1 2",
            "v 1 2 nan",
            "f 1 2 x",
            "f 0 1 2",
            "f 1/a 2 3",
            "l 1 2",
        ]);
        prop_oneof![6 => vertex(), 6 => face(), 1 => other.prop_map(str::to_owned)]
    }

    proptest! {
        #[test]
        fn what_is_read_is_read_as_tobj_does(
            lines in prop::collection::vec(line(), 0..24),
            end in prop::sample::select(vec!["\n", "\r\n", "\r", "\n\n"]),
        ) {
            let text = lines.join(end);
            if let Some(mesh) = read(text.as_bytes(), &MeshLimits::SUGGESTED) {
                let twin = read_by_tobj(text.as_bytes(), &MeshLimits::SUGGESTED);
                prop_assert_eq!(twin, Ok(mesh));
            }
        }

        #[test]
        fn numbers_are_those_of_the_standard_library(text in number()) {
            let file = format!("v {text} 0 0\n");
            let mesh = read(file.as_bytes(), &MeshLimits::SUGGESTED);
            let value: f64 = text.parse().expect("a number");
            prop_assert_eq!(mesh.map(|m| m.vertices.at(0)[0].to_bits()), value.is_finite().then(|| value.to_bits()));
        }
    }

    #[test]
    fn plain_files_are_read() {
        for end in ["\n", "\r\n"] {
            let text = [
                "v 0 0 0",
                "v 1 0 0",
                "v 1 1 0",
                "v 0 1 0",
                "f 4/1 2//1 -2 1",
                "",
            ]
            .join(end);
            let mesh = read(text.as_bytes(), &MeshLimits::SUGGESTED).expect("it is plain");
            assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
            assert_eq!(mesh.vertices.at(0), [0.0, 1.0, 0.0]);
        }
        let points = read(b"v 0 0 0\nv 1 0 0", &MeshLimits::SUGGESTED).expect("it is plain");
        assert_eq!(
            points,
            Mesh {
                vertices: vec![[0.0; 3], [1.0, 0.0, 0.0]].into(),
                triangles: vec![].into()
            }
        );
    }
}
