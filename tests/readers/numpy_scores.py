"""Computes the scores of each line again from its canvas masks with numpy and Pillow."""

from common import check, folders, read_lines
import numpy as np
from PIL import Image


def box(mask):
    """Returns the mask of the bounding box of a mask."""
    filled = np.zeros_like(mask)
    rows, columns = np.nonzero(mask)
    filled[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1] = True
    return filled


def iou(a, b):
    """Returns the intersection over union of two masks."""
    return (a & b).sum() / (a | b).sum()


export, _ = folders()
lines = read_lines(export / "jsonl" / "pairs.jsonl")
for line in lines:
    paths = [export / "jsonl" / line["files"][f"canvas_{name}_mask"] for name in ("depth", "print")]
    levels = [np.asarray(Image.open(path)) for path in paths]
    for path, values in zip(paths, levels):
        check(values.shape == (line["canvas_px"],) * 2, f"{path} has the shape {values.shape}")
        check(np.isin(values, [0, 255]).all(), f"{path} has other values than 0 and 255")
    depth, ink = (values == 255 for values in levels)
    again = {
        "iou": iou(depth, ink),
        "iou_box": iou(box(depth), box(ink)),
        "dice": 2 * (depth & ink).sum() / (depth.sum() + ink.sum()),
        "density_print": ink.mean(),
        "density_depth": depth.mean(),
    }
    for field, value in again.items():
        right = abs(value - line[field]) < 1e-9
        check(right, f"{line['id']}, {line['metric']}: {field} is {line[field]}, the masks give {value}")
print(f"numpy: {len(lines)} lines, the masks give their scores")
