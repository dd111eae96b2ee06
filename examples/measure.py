"""Measures the strokes of one pair of an export of the format `fiji`: area, width, height and wear, in mm.

    mocban -C blocks export --to fiji -o tiff
    pip install numpy tifffile
    python examples/measure.py tiff b04-0117
"""

import json
import sys
from pathlib import Path

import numpy as np
import tifffile


def width_px(mask):
    """Returns the mean width of a stroke in px: four times the mean distance of its pixels to its border."""
    padded = np.pad(mask, 1)
    shifted = [np.roll(padded, step, axis) for step in (-1, 1) for axis in (0, 1)]
    inside, outside = np.argwhere(padded), np.argwhere(np.logical_or.reduce(shifted) & ~padded)
    # The border is half a pixel before the centre of the nearest pixel outside.
    return 4 * np.mean([np.hypot(*(outside - pixel).T).min() - 0.5 for pixel in inside])


def top(heights):
    """Returns the height of the top of a stroke: the 90th percentile, which single scan points do not move."""
    return np.nanpercentile(heights, 90) if np.isfinite(heights).any() else np.nan


def main(export, pair):
    """Prints a table of the strokes, the largest first."""
    lines = map(json.loads, open(Path(export) / "pairs.jsonl", encoding="utf-8"))
    line = next((line for line in lines if line["id"] == pair and line["status"] == "done"), None)
    if line is None:
        sys.exit(f"{export} has no result of the pair {pair}")
    strokes = tifffile.imread(Path(export) / line["files"]["strokes"])
    _, heights, _ = tifffile.imread(Path(export) / line["files"]["stack"])
    # Heights and lengths are mesh units if the unit of the mesh is unknown.
    unit = "mm" if line["mm_per_mesh_unit"] else "mesh unit"
    mm_per_px = line["mesh_unit_per_px"] * (line["mm_per_mesh_unit"] or 1) / line["scale"]
    numbers, areas = np.unique(strokes[strokes > 0], return_counts=True)
    tops = {number: top(heights[strokes == number]) for number in numbers}
    print(f"{pair} {line['character']}: {len(numbers)} strokes, in {unit}; wear is the depth of a top below the highest top")
    print("stroke      area     width     wear")
    for number, area in sorted(zip(numbers, areas), key=lambda stroke: -stroke[1]):
        width = width_px(strokes == number) * mm_per_px
        wear = max(tops.values()) - tops[number]
        print(f"{number:6}  {area * mm_per_px**2:8.3f}  {width:8.3f}  {wear:7.3f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
