"""Reads the VIA 2 file of `annotations`: its boxes are those of the masks, its files exist with the stated size."""

import json

from common import check, folders, read_lines, single_results
import numpy as np
from PIL import Image

export, _ = folders()
root = export / "annotations"
lines = single_results(export, "annotations")
pictures = {(line["id"], line["metric"]): line["files"]["aligned_mask"] for line in read_lines(export / "jsonl" / "pairs.jsonl")}
boxes = {}
for key, image in json.loads((root / "via.json").read_text(encoding="utf-8")).items():
    path = root / "images" / image["filename"]
    check(key == f"{image['filename']}{image['size']}", f"via.json: the key {key} is not name and size")
    check(path.stat().st_size == image["size"], f"via.json: {path} has not {image['size']} bytes")
    for region in image["regions"]:
        shape, attributes = region["shape_attributes"], region["region_attributes"]
        check(shape["name"] == "rect", f"via.json: {key} has a region of the kind {shape['name']}")
        line = lines[attributes["id"]]
        check(attributes["character"] == line["character"], f"via.json: {line['id']} is {attributes['character']!r}")
        boxes[line["id"]] = [shape[side] for side in ("x", "y", "width", "height")]
check(boxes.keys() == lines.keys(), f"via.json has the boxes of {len(boxes)} of {len(lines)} pairs")
for name, box in boxes.items():
    mask = np.asarray(Image.open(export / "jsonl" / pictures[name, lines[name]["metric"]])) == 255
    rows, columns = np.nonzero(mask)
    low, high = (columns.min(), rows.min()), (columns.max(), rows.max())
    expected = [*low, high[0] - low[0] + 1, high[1] - low[1] + 1]
    check(box == expected, f"via.json: {name} has the box {box}, its mask {expected}")
print(f"VIA: {len(boxes)} boxes")
