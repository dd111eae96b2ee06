"""Opens `scan.glb` in trimesh: it has the positions of `scan.ply`, and its points sample the right texels."""

from common import check, folders
from scans import colours, inside, positions, print_pixels, scans, vertex_table
import numpy as np
import trimesh
from scipy.spatial import cKDTree

export, data = folders()
sampled = 0
for line, folder in scans(export):
    name = line["id"]
    table = vertex_table(folder / "scan.ply")
    position, colour = positions(table), colours(table)
    tree = cKDTree(position)
    parts = trimesh.load(folder / "scan.glb", process=False).geometry.values()
    textured = [part for part in parts if getattr(part.visual, "uv", None) is not None]
    check(len(textured) == 1, f"{name}: {len(textured)} parts of scan.glb have a texture")
    for part in parts:
        # glTF is in metres.
        distance = tree.query(part.vertices * 1000)[0].max()
        check(distance < 1e-3, f"{name}: a vertex of scan.glb is {distance} mm from scan.ply")
    part = textured[0]
    texture = np.asarray(part.visual.material.baseColorTexture.convert("RGB"))
    height, width = texture.shape[:2]
    used = np.unique(part.faces)
    place = tree.query(part.vertices[used] * 1000)[1]
    # trimesh counts v from the bottom. Texture coordinates 0 and 1 are the outer edges of the image.
    uv = part.visual.uv[used]
    found = np.stack([uv[:, 0] * width - 0.5, (1 - uv[:, 1]) * height - 0.5], axis=1)
    expected = print_pixels(line, folder, position[place])
    error = np.abs(found - expected).max()
    check(error < 0.01, f"{name}: texture coordinates are {error} px from print_from_mesh")
    covered, texel = inside(found, texture)
    clear = covered & (np.abs(found + 0.5 - np.round(found + 0.5)) > 0.01).all(axis=1)
    check(clear.sum() > 1000, f"{name}: only {clear.sum()} points of scan.glb lie on the texture")
    wrong = (texture[texel[clear, 1], texel[clear, 0]] != colour[place[clear]]).any(axis=1).sum()
    check(wrong == 0, f"{name}: {wrong} points of scan.glb sample another texel than the colour in scan.ply")
    sampled += clear.sum()
print(f"trimesh, scan.glb: {sampled} points sample the right texel")
