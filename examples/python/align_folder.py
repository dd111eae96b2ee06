"""Aligns all pairs of two folders on all processors, and draws confidence against IoU.

Install the wheel of a release, then:

    pip install matplotlib
    python align_folder.py meshes prints
"""

import sys
from pathlib import Path

import mocban

meshes, prints = Path(sys.argv[1]), Path(sys.argv[2])
by_stem = {path.stem: path for path in prints.iterdir()}
pairs = [(path.stem, path, by_stem[path.stem]) for path in sorted(meshes.iterdir()) if path.stem in by_stem]

points = []
for stem, found in mocban.align_many(pairs):
    if isinstance(found, mocban.Error):
        print(f"{stem}: {found.hint}")
    elif found.status == "refused":
        print(f"{stem}: {found.refusal.message}")
    else:
        relief = found.results["relief"]
        points.append((relief.confidence, relief.iou))
        print(f"{stem}: confidence {relief.confidence:.2f}, IoU {relief.iou:.3f}")
print(f"{len(points)} of {len(pairs)} pairs are aligned")

try:
    import matplotlib.pyplot as plt
except ImportError:
    sys.exit("install matplotlib to draw them")
plt.scatter(*zip(*points))
plt.xlabel("confidence")
plt.ylabel("IoU")
plt.savefig("confidence.png")
