"""Reads the shards of `webdataset`: keys, labels, pictures and numbers."""

import io

from common import check, check_labels, check_landmarks, folders, read_lines
import numpy as np
import webdataset
from PIL import Image
from prints import print_rgb

PICTURES = ["print", "print_mask", "depth", "aligned_depth", "aligned_mask"]


def picture(extension, content):
    """Decodes pictures with all bits. The decoder "pil" reduces 16-bit pictures to 8 bits."""
    return np.asarray(Image.open(io.BytesIO(content))) if extension.endswith("png") else None


export, data = folders()
lines = {(line["id"], line["metric"]): line for line in read_lines(export / "jsonl" / "pairs.jsonl")}
rows = []
for shard in sorted((export / "webdataset").glob("*.tar")):
    samples = webdataset.WebDataset(str(shard), shardshuffle=False).decode(picture)
    for sample in samples:
        row = sample["json"]
        check(sample["__key__"] == row["id"], f"webdataset: the key of {row['id']} is {sample['__key__']}")
        split = shard.name.split("-")[0]
        check(row["split"] == split, f"webdataset: {row['id']} is in {shard.name}, but its split is {row['split']}")
        line = lines[row["id"], row["metric"]]
        for name in ("split", "iou", "dice", "threshold_level", "print_from_mesh", "meta"):
            check(row[name] == line[name], f"webdataset: {row['id']}: {name} is {row[name]}, not {line[name]}")
        for name in PICTURES:
            path, found = export / "jsonl" / line["files"][name], sample[f"{name}.png"]
            # Prints are RGB in all samples. Decoders of JPEG differ by a few levels.
            expected = print_rgb(path) if name == "print" else np.asarray(Image.open(path))
            same = found.shape == expected.shape and found.dtype == expected.dtype
            same = same and np.abs(found.astype(int) - expected).max() <= (8 if name == "print" else 0)
            check(same, f"webdataset: {row['id']}: {name} is another picture than in jsonl")
        rows.append(row)
check_labels("webdataset", rows, data)
check_landmarks("webdataset", data, rows)
