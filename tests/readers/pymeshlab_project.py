"""Opens `scan.mlp` in PyMeshLab: one mesh, with the positions, colours and stroke labels of `scan.ply`."""

from common import check, folders
from scans import colours, positions, scans, vertex_table
import numpy as np
import pymeshlab

export, _ = folders()
count = 0
for line, folder in scans(export):
    project = pymeshlab.MeshSet()
    project.load_project(str((folder / "scan.mlp").resolve()))
    check(project.mesh_number() == 1, f"{line['id']}: the project has {project.mesh_number()} meshes")
    mesh, table = project.current_mesh(), vertex_table(folder / "scan.ply")
    expected, found = positions(table), mesh.transformed_vertex_matrix()
    check(found.shape == expected.shape, f"{line['id']}: MeshLab reads {len(found)} of {len(expected)} vertices")
    error = np.abs(found - expected).max()
    check(error < 1e-4, f"{line['id']}: MeshLab shows positions {error} mm off")
    error = np.abs(mesh.vertex_color_matrix()[:, :3] * 255 - colours(table)).max()
    check(error < 0.5, f"{line['id']}: MeshLab reads colours {error} levels off")
    count += len(found)
print(f"PyMeshLab: {count} vertices with position and colour")
