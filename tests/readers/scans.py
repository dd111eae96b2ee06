"""What the scripts of the format `mesh` share."""

from common import apply, single_results
import numpy as np
import trimesh


def scans(export):
    """Yields the lines of all scans with the folder of their files."""
    for line in single_results(export, "mesh").values():
        yield line, (export / "mesh" / line["files"]["ply"]).parent


def vertex_table(path):
    """Returns the vertices of a PLY with all their fields."""
    return trimesh.load(path, process=False).metadata["_ply_raw"]["vertex"]["data"]


def positions(table):
    """Returns the positions of a vertex table."""
    return np.stack([table[axis] for axis in "xyz"], axis=1).astype(float)


def colours(table):
    """Returns the colours of a vertex table."""
    return np.stack([table[name] for name in ("red", "green", "blue")], axis=1)


def print_pixels(line, folder, position):
    """Returns the print pixels of points of `scan.ply` by `matrix.txt` and `print_from_mesh`."""
    mesh_from_scan = np.linalg.inv(np.loadtxt(folder / "matrix.txt"))
    return apply(line["print_from_mesh"], apply(mesh_from_scan[:3], position))[:, :2]


def inside(pixels, picture):
    """Returns which pixels lie on the picture, and the nearest pixel centres."""
    nearest = np.floor(pixels + 0.5).astype(int)
    return ((nearest >= 0) & (nearest < picture.shape[1::-1])).all(axis=1), nearest
