"""Opens the COCO files of `annotations` in pycocotools: masks, boxes, areas, categories, splits and landmarks."""

import contextlib
import io

from common import apply, check, check_labels, check_landmarks, folders, read_lines, single_results
import numpy as np
from PIL import Image
from pycocotools import mask as masks
from pycocotools.coco import COCO

export, data = folders()
root = export / "annotations"
lines = single_results(export, "annotations")
pictures = {(line["id"], line["metric"]): line["files"]["aligned_mask"] for line in read_lines(export / "jsonl" / "pairs.jsonl")}
truths = {truth["id"]: truth for truth in read_lines(data / "truth.jsonl")}
found, shares = [], []
for path in sorted(root.glob("coco*.json")):
    with contextlib.redirect_stdout(io.StringIO()):
        coco = COCO(str(path))
    for annotation in coco.loadAnns(coco.getAnnIds()):
        name = annotation["pair"]
        line = lines[name]
        image = coco.loadImgs(annotation["image_id"])[0]
        size = Image.open(root / image["file_name"]).size
        check(size == (image["width"], image["height"]), f"{name}: the image has the size {size}")
        mask, encoded = coco.annToMask(annotation).astype(bool), coco.annToRLE(annotation)
        expected = np.asarray(Image.open(export / "jsonl" / pictures[name, line["metric"]])) == 255
        check(np.array_equal(mask, expected), f"{name}: the COCO mask is not the aligned mask of jsonl")
        check(mask.sum() == annotation["area"] == masks.area(encoded), f"{name}: the area is {annotation['area']}")
        check(masks.toBbox(encoded).tolist() == annotation["bbox"], f"{name}: the box is {annotation['bbox']}")
        category = coco.loadCats(annotation["category_id"])[0]["name"]
        block, split = annotation["attributes"]["block"], path.stem.removeprefix("coco_")
        found.append({"id": name, "character": category, "block": block, "split": split})
        check(split == line["split"], f"{name}: it is in {path.name}, but its split is {line['split']}")
        landmarks = apply(line["print_from_mesh"], np.array(truths[name]["landmarks"]))[:, :2]
        column, row = np.round(landmarks).astype(int).T
        on_image = (column >= 0) & (row >= 0) & (column < size[0]) & (row < size[1])
        shares.append(mask[row[on_image], column[on_image]].mean())
check_labels("annotations", found, data)
check(min(shares) > 0.8, f"only {min(shares):.0%} of the landmarks of a pair lie on its COCO mask")
check_landmarks("pycocotools", data, lines.values())
