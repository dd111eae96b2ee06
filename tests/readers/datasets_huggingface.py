"""Loads the folder of `huggingface` by `datasets.load_dataset`: splits, features, labels, pictures and numbers."""

import os
import tempfile

os.environ.update(HF_HUB_OFFLINE="1", HF_DATASETS_DISABLE_PROGRESS_BARS="1")
cache = tempfile.TemporaryDirectory()
os.environ["HF_HOME"] = cache.name

from common import check, check_labels, check_landmarks, folders, read_lines  # noqa: E402
import datasets  # noqa: E402
import numpy as np  # noqa: E402
from PIL import Image  # noqa: E402

PICTURES = ["print", "print_mask", "depth", "aligned_depth", "aligned_mask"]

export, data = folders()
loaded = datasets.load_dataset(str(export / "huggingface"))
lines = {(line["id"], line["metric"]): line for line in read_lines(export / "jsonl" / "pairs.jsonl")}
rows = []
for name, part in loaded.items():
    images = [column for column, feature in part.features.items() if isinstance(feature, datasets.Image)]
    check(images == PICTURES, f"huggingface: the image columns of {name} are {images}")
    check(part.features["iou"].dtype == "float64", f"huggingface: iou has the type {part.features['iou']}")
    for row in part:
        check(row["split"] == name, f"huggingface: {row['id']} is in {name}, but its split is {row['split']}")
        line = lines[row["id"], row["metric"]]
        check(row["split"] == line["split"], f"huggingface: {row['id']} is in {name}, in jsonl in {line['split']}")
        check(row["iou"] == line["iou"], f"huggingface: {row['id']}: iou is {row['iou']}, not {line['iou']}")
        ious = {one["metric"]: one["iou"] for one in row["metrics"]}
        expected = {metric: other["iou"] for (pair, metric), other in lines.items() if pair == row["id"]}
        check(ious == expected, f"huggingface: {row['id']}: the metrics are {ious}, not {expected}")
        for column in PICTURES:
            found, stated = np.asarray(row[column]), np.asarray(Image.open(export / "jsonl" / line["files"][column]))
            same = found.shape == stated.shape and (found == stated).all()
            check(same, f"huggingface: {row['id']}: {column} is another picture than in jsonl")
        rows.append(row)
check_labels("huggingface", rows, data)
check_landmarks("huggingface", data, rows)
