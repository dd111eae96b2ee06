"""Opens `scan.ply` in Open3D: it reads the positions, faces and colours that trimesh reads."""

from common import check, folders
from scans import colours, positions, scans, vertex_table
import numpy as np
import open3d
import trimesh

export, _ = folders()
count = 0
for line, folder in scans(export):
    scan = open3d.io.read_triangle_mesh(str(folder / "scan.ply"))
    table = vertex_table(folder / "scan.ply")
    expected, found = positions(table), np.asarray(scan.vertices)
    check(found.shape == expected.shape, f"{line['id']}: Open3D reads {len(found)} of {len(expected)} vertices")
    error = np.abs(found - expected).max()
    check(error < 1e-6, f"{line['id']}: Open3D reads positions {error} mm off")
    error = np.abs(np.asarray(scan.vertex_colors) * 255 - colours(table)).max()
    check(error < 0.5, f"{line['id']}: Open3D reads colours {error} levels off")
    faces = len(trimesh.load(folder / "scan.ply", process=False).faces)
    check(len(scan.triangles) == faces, f"{line['id']}: Open3D reads {len(scan.triangles)} of {faces} faces")
    count += len(found)
print(f"Open3D: {count} vertices with position and colour")
