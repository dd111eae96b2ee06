//! Generates hostile pairs: empty, truncated, corrupted, mistyped or degenerate files, and paths that are not files.

use std::fs;
use std::path::{Path, PathBuf};

use mocban::mesh::Mesh;
use mocban::mesh::write::MeshFormat;
use mocban::raster::{Grid, png_grey8, png_rgb8};

use crate::corruption::Corruptor;
use crate::sample_files::{self, NamedFile};

/// A replacement of a valid file.
enum BadFile {
    /// A file with this extension and content.
    File(String, Vec<u8>),
    /// A path that is not a regular file.
    At(PathBuf),
}

impl BadFile {
    fn file(ending: &str, bytes: impl Into<Vec<u8>>) -> Self {
        Self::File(ending.to_owned(), bytes.into())
    }
}

/// A row of the manifest.
pub(crate) struct HostilePair {
    pub(crate) id: String,
    pub(crate) mesh: PathBuf,
    pub(crate) print: PathBuf,
}

/// Generates pairs in a directory, deterministically from a seed.
pub(crate) struct HostilePairs {
    dir: PathBuf,
    corruptor: Corruptor,
    meshes: Vec<NamedFile>,
    images: Vec<NamedFile>,
    made: usize,
}

impl HostilePairs {
    pub(crate) fn new(dir: &Path, seed: u64) -> Self {
        odd_places(dir);
        let whole = sample_files::relief(40);
        fs::write(
            dir.join("whole.ply"),
            MeshFormat::PlyLittleEndian.encode(&whole),
        )
        .expect("written");
        let (_, print) = sample_files::images().swap_remove(2);
        fs::write(dir.join("whole.png"), print).expect("written");
        Self {
            dir: dir.to_owned(),
            corruptor: Corruptor::new(seed),
            meshes: sample_files::meshes(),
            images: sample_files::images(),
            made: 0,
        }
    }

    /// Makes the next pair, with a bad mesh, a bad print or both.
    pub(crate) fn make(&mut self) -> HostilePair {
        let number = self.made;
        self.made += 1;
        let id = format!("h-{number:05}");
        let mesh =
            (number.is_multiple_of(2) || number.is_multiple_of(7)).then(|| self.mesh(number / 2));
        let print = (number % 2 == 1).then(|| self.print(number / 2));
        HostilePair {
            mesh: self.put(&id, mesh, "whole.ply"),
            print: self.put(&id, print, "whole.png"),
            id,
        }
    }

    fn put(&self, id: &str, bad: Option<BadFile>, whole: &str) -> PathBuf {
        match bad {
            None => whole.into(),
            Some(BadFile::At(path)) => path,
            Some(BadFile::File(ending, bytes)) => {
                let name = format!("{id}.{ending}");
                fs::write(self.dir.join(&name), bytes).expect("written");
                name.into()
            }
        }
    }

    fn corrupted_sample(&mut self, files: fn(&Self) -> &[NamedFile]) -> BadFile {
        let at = self.corruptor.below(files(self).len());
        let (name, whole) = files(self)[at].clone();
        let ending = name.rsplit('.').next().unwrap_or_default();
        BadFile::file(ending, self.corruptor.corrupt(&whole))
    }

    fn mesh(&mut self, number: usize) -> BadFile {
        let cases = 40;
        let stl = |mesh: Mesh| BadFile::file("stl", MeshFormat::StlBinary.encode(&mesh));
        let relief = |change: fn([f64; 3]) -> [f64; 3]| {
            let mut mesh = sample_files::relief(20);
            mesh.vertices.map_in_place(change);
            mesh
        };
        match number % cases {
            0 => BadFile::file("stl", []),
            1 => BadFile::file(
                "ply",
                "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\n\
                property float x\nproperty float y\nproperty float z\nend_header\n",
            ),
            2 => BadFile::file(
                "stl",
                [&[0; 80][..], &u32::MAX.to_le_bytes(), &[0; 50]].concat(),
            ),
            3 => stl(relief(|[x, y, z]| {
                [x, if x > 9.0 { f64::NAN } else { y }, z]
            })),
            4 => stl(relief(|[x, y, _]| [x, y, f64::INFINITY])),
            5 => stl(Mesh::default()),
            6 => stl(relief(|[x, y, _]| [x, y, 0.0])),
            7 => BadFile::file("obj", self.images[3].1.clone()),
            8 => stl(Mesh {
                vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].into(),
                triangles: vec![[0, 1, 2]].into(),
            }),
            9 => stl(relief(|[x, ..]| [x, 2.0 * x, -x])),
            10 => stl(relief(|vertex| vertex.map(|c| c * 1e30))),
            11 => stl(relief(|vertex| vertex.map(|c| c * 1e-30))),
            12 => stl(relief(|_| [3.0, 4.0, 5.0])),
            13 => stl(relief(|[x, y, z]| [x, y * 1e-9, z])),
            14 => stl(relief(|[x, y, z]| [x + 1e12, y - 1e12, z])),
            15 => stl(relief(|[x, y, z]| [x, y, z * 1e6])),
            16 => stl(relief(|[x, y, _]| {
                [x, y, (x * 12.9898 + y * 78.233).sin() * 43758.5453 % 9.0]
            })),
            17 => stl(degenerate(2000)),
            18 => BadFile::file("obj", "v 0 0 0\n".repeat(3000) + "f 1 2 3\n"),
            19 => BadFile::file("xyz", "0 0 0\n1 1 1\n".repeat(100)),
            20 => BadFile::file("ply", [b"ply\n".to_vec(), vec![b'a'; 5000]].concat()),
            21 => stl(relief(|[x, y, z]| [x * 1e150, y, z * 1e-150])),
            22 => BadFile::file(
                "stl",
                "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n",
            ),
            23 => BadFile::At(odd_place(number / cases)),
            _ => self.corrupted_sample(|pairs| &pairs.meshes),
        }
    }

    fn print(&mut self, number: usize) -> BadFile {
        let cases = 32;
        let png = |grid: Grid<u8>| BadFile::file("png", png_grey8(&grid));
        let bars = |width, height| {
            Grid::from_fn(width, height, |x, y| {
                if (x / 4 + y / 4) % 3 == 0 { 0 } else { 255 }
            })
        };
        match number % cases {
            0 => BadFile::file("png", []),
            1 => BadFile::file("png", header(b"IHDR", u32::MAX)),
            2 => BadFile::file("png", header(b"IHDR", 60_000)),
            3 => png(Grid::new(120, 120, 255)),
            4 => png(Grid::new(120, 120, 0)),
            5 => png(Grid::new(1, 1, 9)),
            6 => png(bars(3000, 1)),
            7 => png(bars(1, 3000)),
            8 => png(bars(6000, 8)),
            9 => png(bars(2, 2)),
            10 => png(Grid::from_fn(90, 90, |x, y| {
                (x * 31 + y * 17 + x * y * 7) as u8
            })),
            11 => BadFile::file("tif", self.meshes[0].1.clone()),
            12 => BadFile::file("jpg", "Dear reader,\n"),
            13 => BadFile::file(
                "png",
                png_rgb8(&Grid::from_fn(64, 64, |x, _| [x as u8 * 4; 3])),
            ),
            14 => BadFile::file("gif", "GIF89a\x01\0\x01\0\0\0\0;"),
            15 => png(Grid::from_fn(64, 64, |x, y| {
                u8::from(x != 31 || y != 31) * 255
            })),
            16 => BadFile::At(odd_place(number / cases)),
            _ => self.corrupted_sample(|pairs| &pairs.images),
        }
    }
}

/// Returns the header of a square PNG without data.
fn header(kind: &[u8], side: u32) -> Vec<u8> {
    let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\x0d".to_vec();
    bytes.extend(kind);
    bytes.extend([side.to_be_bytes(), side.to_be_bytes()].concat());
    bytes.extend([8, 0, 0, 0, 0, 0, 0, 0, 0]);
    bytes
}

/// Returns triangles without area, some of them single points.
pub(crate) fn degenerate(count: u32) -> Mesh {
    let vertices = (0..count + 2)
        .map(|at| [f64::from(at % 100), f64::from(at / 100), 0.0])
        .collect();
    let triangles = (0..count)
        .map(|at| {
            if at % 2 == 0 {
                [at; 3]
            } else {
                [at, at + 1, at]
            }
        })
        .collect();
    Mesh {
        vertices,
        triangles,
    }
}

/// Paths that are not regular files.
const PLACES: [&str; 8] = [
    "nowhere.stl",
    "folder",
    "loop-a",
    "pipe",
    "nowhere/1.stl",
    "whole.ply/1.stl",
    "dangling",
    "/dev/zero",
];

fn odd_place(number: usize) -> PathBuf {
    PLACES[number % PLACES.len()].into()
}

fn odd_places(dir: &Path) {
    use std::os::unix::fs::symlink;
    fs::create_dir_all(dir.join("folder")).expect("a folder");
    symlink("loop-b", dir.join("loop-a")).expect("a link");
    symlink("loop-a", dir.join("loop-b")).expect("a link");
    symlink("gone", dir.join("dangling")).expect("a link");
    let made = std::process::Command::new("mkfifo")
        .arg(dir.join("pipe"))
        .status();
    assert!(made.expect("mkfifo").success());
}
