//! Writes placed scans as binary glTF 2.0 with the print as texture.

use std::io::{self, Write};

use serde_json::{Value, json};

use super::placed_mesh::PlacedMesh;

/// Metres per millimetre.
const METRES: f64 = 1e-3;
/// First bytes of a file, its version, and the types of its two chunks.
const MAGIC: u32 = 0x4654_6c67;
const VERSION: u32 = 2;
const JSON_CHUNK: u32 = 0x4e4f_534a;
const BINARY_CHUNK: u32 = 0x004e_4942;
/// Constants of the glTF specification.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34_962;
const ELEMENT_ARRAY_BUFFER: u32 = 34_963;
const TRIANGLES: u32 = 4;
const POINTS: u32 = 0;
const LINEAR: u32 = 9729;
const LINEAR_MIPMAP_LINEAR: u32 = 9987;
const CLAMP_TO_EDGE: u32 = 33_071;

/// The texture of a scan, and what the file says about the scan.
#[derive(Debug)]
pub(super) struct GlbContent<'a> {
    /// Name of the scan.
    pub(super) name: &'a str,
    /// The print as a PNG file.
    pub(super) png: &'a [u8],
    /// Width and height of the print in pixels.
    pub(super) size: [usize; 2],
    /// The fields of `asset.extras`.
    pub(super) extras: Value,
}

/// Writes a scan as GLB: metres, right-handed, y up, with the front of the block towards +z. Faces beside the print
/// have a material of their own without texture.
///
/// # Errors
/// Returns an error if the output cannot be written or would have more than 4 GiB.
pub(super) fn write_glb(
    mesh: &PlacedMesh,
    content: &GlbContent<'_>,
    out: &mut impl Write,
) -> io::Result<()> {
    let buffer = GlbBuffer::new(mesh, content);
    let mut text = document(mesh, content, &buffer).to_string();
    while !text.len().is_multiple_of(4) {
        text.push(' ');
    }
    let padded = buffer.len().next_multiple_of(4);
    let length = u32::try_from(12 + 8 + text.len() + 8 + padded).ok();
    let length =
        length.ok_or_else(|| io::Error::other("the scan is too large: a GLB holds 4 GiB"))?;
    for word in [MAGIC, VERSION, length, text.len() as u32, JSON_CHUNK] {
        out.write_all(&word.to_le_bytes())?;
    }
    out.write_all(text.as_bytes())?;
    for word in [padded as u32, BINARY_CHUNK] {
        out.write_all(&word.to_le_bytes())?;
    }
    for values in [
        buffer.positions.as_flattened(),
        buffer.texture_coordinates.as_flattened(),
    ] {
        for value in values {
            out.write_all(&value.to_le_bytes())?;
        }
    }
    for corner in buffer.corners.iter().flatten() {
        out.write_all(&corner.to_le_bytes())?;
    }
    out.write_all(content.png)?;
    out.write_all(&[0; 3][..padded - buffer.len()])
}

/// The binary chunk, in the order of its parts.
struct GlbBuffer {
    positions: Vec<[f32; 3]>,
    texture_coordinates: Vec<[f32; 2]>,
    /// Corners of the faces over the print, and of the others.
    corners: [Vec<u32>; 2],
    /// Bytes of the PNG.
    png: usize,
}

impl GlbBuffer {
    fn new(mesh: &PlacedMesh, content: &GlbContent<'_>) -> Self {
        let metres = |c: f32| (f64::from(c) * METRES) as f32;
        let pixels = mesh.pixels.iter();
        Self {
            positions: mesh.positions.iter().map(|p| p.map(metres)).collect(),
            texture_coordinates: pixels
                .map(|pixel| texture_coordinates(*pixel, content.size))
                .collect(),
            corners: [true, false].map(|on_print| corners(mesh, on_print)),
            png: content.png.len(),
        }
    }

    /// Returns the sizes of the four parts in bytes.
    fn sizes(&self) -> [usize; 4] {
        let corners = self.corners.iter().map(Vec::len).sum::<usize>();
        [
            12 * self.positions.len(),
            8 * self.positions.len(),
            4 * corners,
            self.png,
        ]
    }

    /// Returns the size of all parts in bytes.
    fn len(&self) -> usize {
        self.sizes().iter().sum()
    }

    /// Returns the buffer views of the parts.
    fn views(&self) -> Vec<Value> {
        let targets = [
            Some(ARRAY_BUFFER),
            Some(ARRAY_BUFFER),
            Some(ELEMENT_ARRAY_BUFFER),
            None,
        ];
        let mut offset = 0;
        let mut view = |(size, target): (usize, Option<u32>)| {
            let mut view = json!({"buffer": 0, "byteOffset": offset, "byteLength": size});
            if let Some(target) = target {
                view["target"] = json!(target);
            }
            offset += size;
            view
        };
        self.sizes()
            .into_iter()
            .zip(targets)
            .map(&mut view)
            .collect()
    }

    /// Returns the accessors: positions, texture coordinates, and the corners of each part that has any.
    fn accessors(&self) -> Vec<Value> {
        let count = self.positions.len();
        let extreme = |start: f32, pick: fn(f32, f32) -> f32| {
            [0, 1, 2].map(|k| f64::from(self.positions.iter().map(|p| p[k]).fold(start, pick)))
        };
        let mut all = vec![
            json!({
                "bufferView": 0, "componentType": FLOAT, "type": "VEC3", "count": count,
                "min": extreme(f32::INFINITY, f32::min), "max": extreme(f32::NEG_INFINITY, f32::max),
            }),
            json!({"bufferView": 1, "componentType": FLOAT, "type": "VEC2", "count": count}),
        ];
        let mut offset = 0;
        for corners in self.corners.iter().filter(|corners| !corners.is_empty()) {
            all.push(json!({
                "bufferView": 2, "byteOffset": offset, "componentType": UNSIGNED_INT,
                "type": "SCALAR", "count": corners.len(),
            }));
            offset += 4 * corners.len();
        }
        all
    }
}

/// Returns the JSON chunk. Faces beside the print have a material without texture.
fn document(mesh: &PlacedMesh, content: &GlbContent<'_>, buffer: &GlbBuffer) -> Value {
    let mode = if mesh.source.triangles.is_empty() {
        POINTS
    } else {
        TRIANGLES
    };
    let printed =
        json!({"metallicFactor": 0, "roughnessFactor": 1, "baseColorTexture": {"index": 0}});
    let white = json!({"metallicFactor": 0, "roughnessFactor": 1});
    let parts = [
        ("print", printed, json!({"POSITION": 0, "TEXCOORD_0": 1})),
        ("beside the print", white, json!({"POSITION": 0})),
    ];
    let (mut materials, mut primitives) = (Vec::new(), Vec::new());
    for ((name, colours, attributes), corners) in parts.into_iter().zip(&buffer.corners) {
        if corners.is_empty() {
            continue;
        }
        let material = materials.len();
        primitives.push(json!({
            "attributes": attributes, "indices": 2 + material, "material": material, "mode": mode,
        }));
        materials.push(json!({"name": name, "doubleSided": true, "pbrMetallicRoughness": colours}));
    }
    json!({
        "asset": {
            "version": "2.0",
            "generator": concat!("mocban ", env!("CARGO_PKG_VERSION")),
            "extras": content.extras,
        },
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": content.name, "mesh": 0}],
        "meshes": [{"name": content.name, "primitives": primitives}],
        "materials": materials,
        "textures": [{"source": 0, "sampler": 0}],
        "images": [{"name": "print", "mimeType": "image/png", "bufferView": 3}],
        "samplers": [{
            "magFilter": LINEAR, "minFilter": LINEAR_MIPMAP_LINEAR,
            "wrapS": CLAMP_TO_EDGE, "wrapT": CLAMP_TO_EDGE,
        }],
        "accessors": buffer.accessors(),
        "bufferViews": buffer.views(),
        "buffers": [{"byteLength": buffer.len()}],
    })
}

/// Returns the texture coordinates of a print pixel. The origin is the upper left corner of the image, not the centre
/// of its first pixel.
pub(crate) fn texture_coordinates(pixel: [f32; 2], size: [usize; 2]) -> [f32; 2] {
    [0, 1].map(|k| ((f64::from(pixel[k]) + 0.5) / size[k] as f64) as f32)
}

/// Returns the corners of the faces with all corners over the print, or of the other faces. For a point set, returns
/// the points instead.
fn corners(mesh: &PlacedMesh, on_print: bool) -> Vec<u32> {
    if mesh.source.triangles.is_empty() {
        let points = 0..mesh.positions.len() as u32;
        return points
            .filter(|point| mesh.is_on_print(*point) == on_print)
            .collect();
    }
    let is_on_print = |face: &&[u32; 3]| face.iter().all(|corner| mesh.is_on_print(*corner));
    let faces = mesh.source.triangles.iter();
    faces
        .filter(|face| is_on_print(face) == on_print)
        .flatten()
        .copied()
        .collect()
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::{GlbContent, write_glb};
    use crate::mesh::placed_mesh::PlacedMesh;
    use crate::mesh::placed_mesh::tests::{placed, print};
    use mocban_core::raster::png_rgb8;

    const SIZE: [usize; 2] = [200, 100];

    /// Writes a scan and returns the parsed JSON and the binary chunk.
    fn written(mesh: &PlacedMesh) -> (Value, Vec<u8>) {
        let content = GlbContent {
            name: "a",
            png: &png_rgb8(&print()),
            size: SIZE,
            extras: json!({"unit": "m"}),
        };
        let mut file = Vec::new();
        write_glb(mesh, &content, &mut file).expect("written");
        let word =
            |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().expect("4 bytes")) as usize;
        assert_eq!(file[..8], *b"glTF\x02\0\0\0");
        assert_eq!(word(8), file.len());
        let binary = 20 + word(12);
        assert_eq!(
            [file[16..20].to_vec(), file[binary + 4..binary + 8].to_vec()],
            [b"JSON", b"BIN\0"]
        );
        assert_eq!(binary + 8 + word(binary), file.len());
        let document = serde_json::from_slice(&file[20..binary]).expect("JSON");
        (document, file[binary + 8..].to_vec())
    }

    /// Returns the bytes of a buffer view.
    fn view((document, binary): &(Value, Vec<u8>), index: usize) -> &[u8] {
        let view = &document["bufferViews"][index];
        let number = |field: &str| view[field].as_u64().expect("a number") as usize;
        &binary[number("byteOffset")..][..number("byteLength")]
    }

    fn floats(bytes: &[u8]) -> Vec<f32> {
        let (words, _) = bytes.as_chunks::<4>();
        words.iter().map(|word| f32::from_le_bytes(*word)).collect()
    }

    #[test]
    fn texture_coordinates_sample_the_colour_of_the_vertex() {
        let mesh = placed(None);
        let file = written(&mesh);
        assert_eq!(view(&file, 3), png_rgb8(&print()));
        let coordinates = floats(view(&file, 1));
        for (uv, colour) in coordinates.chunks(2).zip(&mesh.colours).take(4) {
            let [x, y] = [0, 1].map(|k| (uv[k] * SIZE[k] as f32) as usize);
            assert_eq!(Some(print().at(x, y)), *colour);
        }
    }

    #[test]
    fn faces_beside_the_print_have_no_texture() {
        let file = written(&placed(None));
        let primitives = file.0["meshes"][0]["primitives"]
            .as_array()
            .expect("a list");
        assert_eq!(primitives.len(), 2);
        let accessor = |k: usize| &file.0["accessors"][k];
        assert_eq!([&accessor(2)["count"], &accessor(3)["count"]], [6, 3]);
        let (indices, _) = view(&file, 2).as_chunks::<4>();
        let indices: Vec<u32> = indices
            .iter()
            .map(|word| u32::from_le_bytes(*word))
            .collect();
        assert_eq!(indices, [0, 1, 2, 2, 1, 3, 2, 3, 4]);
        let material = primitives[1]["material"].as_u64().expect("a number") as usize;
        assert!(
            file.0["materials"][material]["pbrMetallicRoughness"]["baseColorTexture"].is_null()
        );
    }

    #[test]
    fn positions_are_metres_within_the_stated_bounds() {
        let mesh = placed(None);
        let file = written(&mesh);
        let metres = floats(view(&file, 0));
        let millimetres = mesh.positions.as_flattened();
        assert!(
            metres
                .iter()
                .zip(millimetres)
                .all(|(m, mm)| (1e3 * m - mm).abs() < 1e-4)
        );
        let x = metres.iter().step_by(3).copied();
        let stated = file.0["accessors"][0]["min"][0].as_f64();
        assert_eq!(stated, Some(f64::from(x.fold(f32::INFINITY, f32::min))));
    }

    #[test]
    fn a_point_set_is_written_as_points() {
        let mut mesh = placed(None);
        mesh.source.triangles = Vec::new().into();
        let file = written(&mesh);
        let primitives = &file.0["meshes"][0]["primitives"];
        assert_eq!([&primitives[0]["mode"], &primitives[1]["mode"]], [0, 0]);
        assert_eq!(file.0["accessors"][2]["count"], 4);
    }
}
