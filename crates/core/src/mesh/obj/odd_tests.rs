//! Generated OBJ files with odd lines, compared with what `tobj` reads.

use std::panic::{AssertUnwindSafe, catch_unwind};

use super::plain::OddLine;
use super::{by_tobj, plain, read};
use crate::mesh::{Mesh, MeshError, MeshLimits};

const LIMITS: MeshLimits = MeshLimits::SUGGESTED;

/// The corners of all triangles, as bits of their coordinates.
type Soup = Vec<[u64; 9]>;

fn soup(mesh: &Mesh) -> Soup {
    let corner = |index: u32| mesh.vertices.at(index as usize).map(f64::to_bits);
    let triangles = mesh.triangles.iter();
    triangles
        .map(|triangle| {
            let corners = triangle.map(corner);
            std::array::from_fn(|at| corners[at / 3][at % 3])
        })
        .collect()
}

/// Reads the triangles of a file with `tobj` alone. Returns `None` if it refuses the file or panics.
fn by_tobj_alone(bytes: &[u8]) -> Option<Soup> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let no_materials = |_: &std::path::Path| Err(tobj::LoadError::OpenFileFailed);
    let load = || tobj::load_obj_buf(&mut &*bytes, &options, no_materials);
    let (models, _) = catch_unwind(AssertUnwindSafe(load)).ok()?.ok()?;
    let triangles = models.iter().flat_map(|model| {
        let at = |index: &u32| &model.mesh.positions[3 * *index as usize..][..3];
        let (triangles, _) = model.mesh.indices.as_chunks::<3>();
        triangles.iter().map(move |triangle| {
            let corners: Vec<f64> = triangle.iter().flat_map(at).copied().collect();
            std::array::from_fn(|at| corners[at].to_bits())
        })
    });
    Some(triangles.collect())
}

/// Rewrites a file for `tobj`, slowly: its `v` and `f` lines with line feeds, without comments, continuations and
/// colours. Returns the number of vertices, too.
fn rewritten(bytes: &[u8]) -> (String, usize) {
    let text = String::from_utf8_lossy(bytes).into_owned();
    let mut lines: Vec<String> = Vec::new();
    let mut is_continued = false;
    for line in text.split(line_ends(bytes)) {
        let line = line.trim_matches(|c: char| c.is_ascii_whitespace());
        let first_word = line.trim_end_matches('\\').split_whitespace().next();
        let is_geometry = first_word == Some("v") || first_word == Some("f");
        let line = line.split('#').next().unwrap_or_default();
        let line = line.trim_end_matches(|c: char| c.is_ascii_whitespace());
        let (part, continues) = line
            .strip_suffix('\\')
            .map_or((line, false), |part| (part, true));
        if is_continued {
            let last = lines.last_mut().expect("a line");
            last.push(' ');
            last.push_str(part);
        } else {
            lines.push(if is_geometry { part } else { "" }.to_owned());
        }
        is_continued = continues && (is_continued || is_geometry);
    }
    let mut out = String::new();
    let mut vertices = 0;
    for line in lines {
        let mut words: Vec<&str> = line.split_whitespace().collect();
        match words.first() {
            Some(&"v") => {
                vertices += 1;
                if [7, 8].contains(&words.len()) {
                    words.truncate(4);
                }
            }
            Some(&"f") if words.len() > 1 => {}
            _ => continue,
        }
        out += &(words.join(" ") + "\n");
    }
    (out, vertices)
}

/// Returns whether a file is refused that `tobj` reads, for a weight or because it ends within a face.
fn is_stricter(error: &MeshError) -> bool {
    let error = error.to_string();
    error.contains("neither a weight of 1") || error.contains("the last line is a face with")
}

/// Returns the characters that end lines: LF, and also CR if that ends more of them.
fn line_ends(bytes: &[u8]) -> &'static [char] {
    let text = String::from_utf8_lossy(bytes).replace("\r\n", "\n");
    let count = |end| text.matches(end).count();
    if count('\r') > count('\n') {
        &['\r', '\n']
    } else {
        &['\n']
    }
}

/// Which of the ways a file was read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Outcome {
    Plain,
    ByTobj,
    Refused,
}

/// Checks a file against `tobj`.
fn check(bytes: &[u8]) -> Outcome {
    let name = String::from_utf8_lossy(bytes);
    let ours = read(bytes, &LIMITS).map(|(mesh, _)| mesh);
    // `tobj` makes faces of polylines, and ignores a `v` that is continued.
    let ends: Vec<u8> = line_ends(bytes).iter().map(|end| *end as u8).collect();
    let first_word = |line: &[u8]| {
        let line = String::from_utf8_lossy(line);
        let word = line.split_whitespace().next().map(str::to_owned);
        word.unwrap_or_default()
    };
    let is_known = |line: &&[u8]| !matches!(&*first_word(line), "l" | "v\\" | "f\\");
    let lines: Vec<&[u8]> = bytes.split(|byte| ends.contains(byte)).collect();
    let known: Vec<&[u8]> = lines.iter().copied().filter(is_known).collect();
    if let Some(theirs) = by_tobj_alone(&known.join(&b'\n'))
        && !theirs.is_empty()
        && !lines.iter().any(|line| first_word(line).ends_with('\\'))
    {
        match ours.as_ref().map(soup) {
            Ok(ours) => assert_eq!(ours, theirs, "{name}"),
            Err(error) => assert!(is_stricter(error), "{error}: {name}"),
        }
    }
    let (text, vertices) = rewritten(bytes);
    match (&ours, by_tobj_alone(text.as_bytes())) {
        (Ok(mesh), Some(theirs)) => {
            assert_eq!(soup(mesh), theirs, "{name}");
            if theirs.is_empty() {
                assert_eq!(mesh.vertices.len(), vertices, "{name}");
            }
        }
        (Ok(_), None) => panic!("only tobj refuses {name}"),
        (Err(error), theirs) => {
            let sentence = error.to_string();
            assert!(
                !sentence.is_empty() && sentence.lines().count() == 1,
                "{sentence}"
            );
            assert!(theirs.is_none() || is_stricter(error), "{sentence}: {name}");
        }
    }
    match plain::read(bytes, &LIMITS) {
        Ok(mesh) if mesh.is_ok() => {
            let again = by_tobj::read(text.as_bytes(), OddLine(1), &LIMITS);
            let soups = [again, mesh].map(|read| read.map(|(mesh, _)| soup(&mesh)).ok());
            assert_eq!(soups[0], soups[1], "{name}");
            Outcome::Plain
        }
        Err(_) if ours.is_ok() => Outcome::ByTobj,
        _ => Outcome::Refused,
    }
}

/// A small generator of random numbers (xorshift64*), and how rare odd parts of a file are.
struct Random(u64, usize);

impl Random {
    fn new(seed: u64) -> Self {
        let state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        Self(state, [1, 4, 16, 64][seed as usize % 4])
    }

    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) as usize % end
    }

    fn of<'a, T: ?Sized>(&mut self, all: &[&'a T]) -> &'a T {
        all[self.below(all.len())]
    }

    fn one_in(&mut self, count: usize) -> bool {
        self.below(count * self.1) == 0
    }
}

const ODD_NUMBERS: [&str; 22] = [
    "1e3",
    "-.5E-2",
    "+7",
    "1.",
    ".",
    "-",
    "1e",
    "0x10",
    "nan",
    "-inf",
    "1e999",
    "1_000",
    "0,5",
    "1d0",
    "--1",
    "00000000000000000000000001",
    "123456789012345678901234567890",
    "4.9e-324",
    "1e-400",
    "\u{661}",
    "1#",
    "",
];
const SPACES: [&str; 9] = [
    " ", " ", " ", "  ", "\t", " \t ", "\u{b}", "\u{c}", "\u{a0}",
];
const ODD_LINES: [&str; 40] = [
    "",
    " ",
    "#",
    "# v 1 2 3",
    "#v 1 2 3",
    "# C:\\a\\",
    "vn 0 0 1",
    "vn 0 0",
    "vn",
    "vt .5 .5",
    "vt a",
    "vp 1 2",
    "g",
    "g a b",
    "g\ta\\",
    "o x y",
    "o",
    "s 1",
    "s off",
    "usemtl",
    "usemtl m",
    "usemtl a\\",
    "mtllib",
    "mtllib a.mtl",
    "mtllib a.mtl \\",
    "l 1 2",
    "l 1 2 3",
    "p 1",
    "f",
    "f #",
    "v",
    "v\\",
    "f\\",
    "curv 0 1 1 2",
    "vé 1 2 3",
    "V 1 2 3",
    "F 1 2 3",
    "call a.obj",
    "\u{3000}v 1 2 3",
    "end",
];
const SLASHES: [&str; 14] = [
    "",
    "",
    "",
    "",
    "/",
    "//",
    "/1",
    "//1",
    "/1/1",
    "///",
    "/1/1/1",
    "/x",
    "/99/-99",
    "/-9223372036854775808",
];

fn number(random: &mut Random) -> String {
    if random.one_in(25) {
        return random.of(&ODD_NUMBERS).to_owned();
    }
    let value = (random.below(2_000_001) as f64 - 1e6) / 1000.0;
    match random.below(4) {
        0 => format!("{value:e}"),
        1 => format!("{value:.6}"),
        _ => format!("{value}"),
    }
}

fn vertex_line(random: &mut Random) -> String {
    let mut words = vec!["v".to_owned()];
    let mut count = if random.one_in(6) { 6 } else { 3 };
    if random.one_in(8) {
        count = random.below(10);
    }
    words.extend((0..count).map(|_| number(random)));
    let space = if random.one_in(3) {
        random.of(&SPACES)
    } else {
        " "
    };
    words.join(space)
}

fn face_line(random: &mut Random, vertices: usize) -> String {
    let mut corners = 3 + random.below(3);
    if random.one_in(8) {
        corners = random.below(9);
    }
    let mut words = vec!["f".to_owned()];
    for _ in 0..corners {
        let vertex = 1 + random.below(vertices.max(1));
        let mut index = if random.below(5) == 0 {
            format!("-{vertex}")
        } else {
            vertex.to_string()
        };
        if random.one_in(20) {
            index = random
                .of(&[
                    "0",
                    "-0",
                    "+1",
                    "001",
                    "99",
                    "-99",
                    "9223372036854775808",
                    "x",
                ])
                .to_owned();
        }
        if random.one_in(4) {
            index += random.of(&SLASHES);
        }
        words.push(index);
    }
    let space = if random.one_in(3) {
        random.of(&SPACES)
    } else {
        " "
    };
    words.join(space)
}

/// Generates a file of which some parts are odd.
fn odd_file(seed: u64) -> Vec<u8> {
    let random = &mut Random::new(seed);
    let mut lines = Vec::new();
    let mut vertices = 0;
    for at in 0..random.below(24) {
        let mut line = if at < 4 || random.below(2) == 0 {
            vertices += 1;
            vertex_line(random)
        } else {
            face_line(random, vertices)
        };
        if random.one_in(5) {
            lines.push(random.of(&ODD_LINES).to_owned());
        }
        if random.one_in(8) {
            line += random.of(&[" # a", "#", " ", "\\", " \\", "#\\", " \r", "\r"]);
        }
        if random.one_in(20) {
            let space = line.find(' ').unwrap_or(0);
            line.insert_str(space, "\\\n");
        }
        lines.push(line);
    }
    let end = random.of(&["\n", "\n", "\n", "\r\n", "\r", "\n\n"]);
    let mut bytes = lines.join(end).into_bytes();
    if random.one_in(10) && !bytes.is_empty() {
        let at = random.below(bytes.len());
        bytes[at] = [0xff, 0, b'\r', b'\n', b'\\', b'#'][random.below(6)];
    }
    bytes
}

/// Changes, repeats, moves and removes bytes of a file.
fn mutated(seed: u64) -> Vec<u8> {
    let random = &mut Random::new(seed ^ 0x5eed);
    let mut bytes = odd_file(3 + seed % 50 * 4);
    bytes.extend(b"\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf -1 -2 -3\n");
    for _ in 0..=random.below(2) {
        let at = random.below(bytes.len());
        let until = (at + 1 + random.below(12)).min(bytes.len());
        match random.below(5) {
            0 => bytes[at] = random.below(256) as u8,
            1 => {
                bytes[at] = *random.of(&[&b' ', &b'\n', &b'1', &b'/', &b'-', &b'\\', &b'v', &b'.']);
            }
            2 => bytes = [&bytes[..until], &bytes[at..]].concat(),
            3 => bytes = [&bytes[..at], &bytes[until..]].concat(),
            _ => bytes[at..until].reverse(),
        }
        if bytes.is_empty() {
            bytes.push(b'v');
        }
    }
    bytes
}

fn outcomes(files: impl Iterator<Item = Vec<u8>>) -> [usize; 3] {
    let mut counts = [0; 3];
    for bytes in files {
        counts[check(&bytes) as usize] += 1;
    }
    counts
}

#[test]
fn odd_files_are_read_as_by_tobj_or_refused() {
    let counts = outcomes((0..2000).map(odd_file));
    assert!(counts.iter().all(|count| *count > 200), "{counts:?}");
}

#[test]
fn mutated_files_are_read_as_by_tobj_or_refused() {
    let counts = outcomes((0..2000).map(mutated));
    assert!(counts.iter().all(|count| *count > 100), "{counts:?}");
}
