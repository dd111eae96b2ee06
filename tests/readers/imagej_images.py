"""Opens the images of `fiji` in ImageJ without a window: calibration, channels, a height and the number of strokes.

`IMAGEJ_JAR` names `ij.jar`; Debian's package `imagej` has it.
"""

import os
import subprocess
import tempfile
from pathlib import Path

from common import check, folders, mm_per_mesh_unit, program, single_results, skip
import numpy as np
import tifffile

JAR = Path(os.environ.get("IMAGEJ_JAR", "/usr/share/java/ij.jar"))
MACRO = """
open("{folder}/heights.tif"); getPixelSize(unit, width, height);
print("heights", unit, width, height, bitDepth(), getPixel({x}, {y}));
open("{folder}/stack.tif"); getPixelSize(unit, width, height); getDimensions(w, h, channels, slices, frames);
print("stack", unit, width, height, bitDepth(), channels);
open("{folder}/strokes.tif"); getPixelSize(unit, width, height); getStatistics(area, mean, min, max);
print("strokes", unit, width, height, bitDepth(), max);
run("Quit");
"""


def numbers(folder, x, y):
    """Returns what ImageJ prints of each image: unit, pixel width and height, bits, and a number."""
    with tempfile.TemporaryDirectory() as scratch:
        macro = Path(scratch) / "check.ijm"
        macro.write_text(MACRO.format(folder=folder.resolve(), x=x, y=y))
        command = [*tools, f"-Duser.home={scratch}", "-jar", JAR, "-batch", macro]
        done = subprocess.run(command, capture_output=True, text=True, timeout=600, env=os.environ | {"HOME": scratch})
    found = {row.split(" ")[0]: row.split(" ")[1:] for row in done.stdout.splitlines() if row}
    check({"heights", "stack", "strokes"} <= found.keys(), f"ImageJ prints {' '.join((done.stdout + done.stderr).split())}")
    return found


export, _ = folders()
JAR.exists() or skip(f"ImageJ is not installed as {JAR}")
tools = [program("xvfb-run"), "-a", program("java")]
lines = [line for line in single_results(export, "fiji").values() if line["mm_per_mesh_unit"]]
for line in lines[:2]:
    name, folder = line["id"], (export / "fiji" / line["files"]["heights"]).parent
    heights, strokes = tifffile.imread(folder / "heights.tif"), tifffile.imread(folder / "strokes.tif")
    y, x = np.argwhere(np.isfinite(heights))[len(heights)]
    mm_per_px = line["mesh_unit_per_px"] * mm_per_mesh_unit(line)
    sizes = {"heights": mm_per_px, "stack": mm_per_px / line["scale"], "strokes": mm_per_px / line["scale"]}
    expected = {"heights": ("32", heights[y, x]), "stack": ("32", 3), "strokes": ("16", strokes.max())}
    for image, (unit, width, height, bits, number) in numbers(folder, x, y).items():
        right = unit == "mm" and all(abs(float(side) - sizes[image]) < 1e-3 * sizes[image] + 1e-4 for side in (width, height))
        check(right, f"{name}: ImageJ calibrates {image}.tif as {width} x {height} {unit}, not {sizes[image]} mm")
        check(bits == expected[image][0], f"{name}: ImageJ reads {image}.tif with {bits} bits")
        right = abs(float(number) - expected[image][1]) < 1e-3
        check(right, f"{name}: ImageJ reads {number} in {image}.tif, not {expected[image][1]}")
    print(f"ImageJ: {name}: calibrated heights, stack and {number} strokes")
