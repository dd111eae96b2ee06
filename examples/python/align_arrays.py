"""Aligns a scan that trimesh has read, and compares the height of the strokes with the print's grey.

Install the wheel of a release, then:

    pip install trimesh pillow
    python align_arrays.py scan.stl print.png
"""

import sys

import mocban
import numpy as np
import trimesh
from PIL import Image

scan = trimesh.load(sys.argv[1], force="mesh", process=False)
image = np.asarray(Image.open(sys.argv[2]).convert("RGB"))

found = mocban.align(mocban.Mesh(scan.vertices, scan.faces, unit="mm"), image)
if found.status == "refused":
    sys.exit(f"not aligned: {found.refusal.message}")
print(found)

# Print pixel of every vertex, and its height over the plane. On a flat block, the threshold is at one such height.
x, y, height = found.project(scan.vertices).T
inside = (x >= 0) & (y >= 0) & (x < image.shape[1] - 1) & (y < image.shape[0] - 1)
grey = image.mean(axis=2)[np.rint(y[inside]).astype(int), np.rint(x[inside]).astype(int)]
strokes = height[inside] > found.results["relief"].threshold_depth
print(f"mean grey on strokes {grey[strokes].mean():.0f}, beside them {grey[~strokes].mean():.0f}")
found.save("aligned")
