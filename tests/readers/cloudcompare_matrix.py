"""Moves an original scan by `matrix.txt` in CloudCompare, and compares it with `scan.ply`."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from common import check, folders, program, source
from scans import positions, scans, vertex_table
import trimesh
from scipy.spatial import cKDTree

export, data = folders()
tools = [program("xvfb-run"), "-a", program("CloudCompare", "cloudcompare.CloudCompare")]
# One scan with an inner unit, one without: starting the program takes seconds.
for line, folder in list(scans(export))[:2]:
    name, mesh = line["id"], source(data, "meshes", line["id"])
    with tempfile.TemporaryDirectory() as scratch:
        moved, original = Path(scratch) / "moved.ply", Path(scratch) / f"original{mesh.suffix}"
        shutil.copy(mesh, original)
        command = [*tools, "-SILENT", "-AUTO_SAVE", "OFF", "-M_EXPORT_FMT", "PLY", "-O", original]
        command += ["-APPLY_TRANS", folder / "matrix.txt", "-SAVE_MESHES", "FILE", moved]
        environment = os.environ | {"XDG_RUNTIME_DIR": scratch, "HOME": scratch}
        done = subprocess.run(command, capture_output=True, text=True, timeout=600, env=environment)
        check(moved.exists(), f"{name}: CloudCompare wrote nothing: {' '.join(done.stdout[-300:].split())}")
        found = trimesh.load(moved, process=False).vertices
    distance = cKDTree(positions(vertex_table(folder / "scan.ply"))).query(found)[0].max()
    check(distance < 0.01, f"{name}: CloudCompare moves a vertex {distance} mm beside scan.ply")
    print(f"CloudCompare: {name}: {len(found)} vertices within {distance:.5f} mm of scan.ply")
