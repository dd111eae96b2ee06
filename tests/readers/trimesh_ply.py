"""Opens `scan.ply` in trimesh: positions, heights, stroke labels and colours against the scan and the print."""

from common import apply, check, check_labels, check_landmarks, folders, heights_mm, mm_per_mesh_unit, source
from scans import colours, inside, positions, print_pixels, scans, vertex_table
import numpy as np
import trimesh
from prints import print_rgb
from scipy.spatial import cKDTree


def check_matrix(name, matrix):
    """Checks that a matrix is a similarity without reflection."""
    linear = matrix[:3, :3]
    scale = np.cbrt(np.linalg.det(linear))
    check(scale > 0, f"{name}: matrix.txt reflects")
    error = np.abs(linear.T @ linear / scale**2 - np.eye(3)).max()
    check(error < 1e-9, f"{name}: matrix.txt is no similarity: {error}")


def landing(line, points):
    """Returns the print pixels of mesh points by `matrix.txt` and the scale of the print, as docs/reference/data.md says."""
    mm_per_print_px = line["mesh_unit_per_px"] * mm_per_mesh_unit(line) / line["scale"]
    centre = (np.array(sizes[line["id"]]) - 1) / 2
    return centre - apply(matrices[line["id"]][:2], points) / mm_per_print_px


export, data = folders()
matrices, sizes, lines = {}, {}, []
for line, folder in scans(export):
    name, matrix = line["id"], np.loadtxt(folder / "matrix.txt")
    check_matrix(name, matrix)
    table = vertex_table(folder / "scan.ply")
    position = positions(table)
    original = trimesh.load(source(data, "meshes", name), process=False).vertices
    distance = cKDTree(position).query(apply(matrix[:3], original))[0].max()
    check(distance < 1e-3, f"{name}: a vertex of the original is {distance} mm from scan.ply")
    height = heights_mm(line, apply(np.linalg.inv(matrix)[:3], position))
    error = np.abs(height - table["height"]).max()
    check(error < 0.01, f"{name}: heights differ from the mesh by {error} mm")
    picture = print_rgb(source(data, "prints", name))
    pixels = print_pixels(line, folder, position)
    covered, nearest = inside(pixels, picture)
    above = height - line["threshold_depth"] * mm_per_mesh_unit(line)
    wrong = ((table["stroke"] == 1) != ((above >= 0) & covered)) & (np.abs(above) > 1e-3)
    check(not wrong.any(), f"{name}: {wrong.sum()} stroke labels differ from the height model")
    # Near the border between two pixels, rounding decides; decoders of JPEG differ by a few levels.
    clear = covered & (np.abs(pixels + 0.5 - np.round(pixels + 0.5)) > 0.01).all(axis=1)
    off = np.abs(colours(table)[clear] - picture[nearest[clear, 1], nearest[clear, 0]].astype(int))
    check(np.percentile(off, 99) <= 4, f"{name}: colours are {np.percentile(off, 99)} levels from the print (99 %)")
    check((colours(table)[~covered] == 255).all(), f"{name}: vertices beside the print are not white")
    matrices[name], sizes[name] = matrix, picture.shape[1::-1]
    lines.append(line)
check_labels("mesh", lines, data)
check_landmarks("trimesh, scan.ply", data, lines, landing)
