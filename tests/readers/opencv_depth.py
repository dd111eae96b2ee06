"""Compares 16-bit depth maps in OpenCV and Pillow, and their heights with the faces of the mesh."""

from common import apply, check, folders, heights_mm, mm_per_mesh_unit, read_lines, source
import cv2
import numpy as np
import trimesh
from PIL import Image

SAMPLES = 20
TOLERANCE_MM = 0.01


def read_both(path):
    """Returns the levels of a picture, which both readers must read alike."""
    levels = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    check(levels is not None and levels.dtype == np.uint16 and levels.ndim == 2, f"{path} is not 16-bit grey in OpenCV")
    check(np.array_equal(np.asarray(Image.open(path)), levels), f"{path} differs between Pillow and OpenCV")
    return levels


def cross(a, b):
    """Returns the cross products of vectors in rows."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def highest(corners, heights, place):
    """Returns the height of the upper side at a place: the highest of all faces that cover it."""
    above = (corners >= place).sum(axis=1)
    near = ((above > 0) & (above < 3)).all(axis=1)
    a, b, c = corners[near].transpose(1, 0, 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.stack([cross(c - b, place - b), cross(a - c, place - c), cross(b - a, place - a)], axis=1)
        share /= cross(b - a, c - a)[:, None]
    covers = (share >= 0).all(axis=1)
    return (share * heights[near]).sum(axis=1)[covers].max(initial=-np.inf)


export, data = folders()
lines = {line["id"]: line for line in read_lines(export / "jsonl" / "pairs.jsonl")}.values()
most = []
for line in lines:
    depth, aligned = (read_both(export / "jsonl" / line["files"][name]) for name in ("depth", "aligned_depth"))
    check(list(depth.shape[::-1]) == line["depth_size_px"], f"{line['id']}: the depth map has the shape {depth.shape}")
    check(aligned.max() <= depth.max(), f"{line['id']}: the aligned depth map is higher than the depth map")
    mesh = trimesh.load(source(data, "meshes", line["id"]), process=False)
    points = np.asarray(mesh.vertices)
    places = apply(line["depth_from_plane"], apply(line["plane_from_mesh"][:3], points)[:, :2])
    corners, heights = places[mesh.faces], heights_mm(line, points)[mesh.faces]
    rows, columns = np.nonzero(depth)
    errors = []
    for k in np.linspace(0, len(rows) - 1, SAMPLES).astype(int):
        level = int(depth[rows[k], columns[k]])
        found = (line["height_min"] + (level - 1) * line["height_per_level"]) * mm_per_mesh_unit(line)
        errors.append(abs(found - highest(corners, heights, np.array([columns[k], rows[k]]))))
    most.append(max(errors))
    check(most[-1] < TOLERANCE_MM, f"{line['id']}: a height is {most[-1]:.4f} mm from the mesh")
print(f"opencv: {len(lines)} depth maps as in Pillow, at most {max(most):.5f} mm from the mesh")
