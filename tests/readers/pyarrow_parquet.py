"""Reads the table of `parquet` in pyarrow and pandas: types, values and pictures are those of `jsonl`."""

import io

from common import check, check_labels, check_landmarks, folders, read_lines
import numpy as np
import pandas
import pyarrow
import pyarrow.parquet
from PIL import Image

TYPES = {
    "id": pyarrow.string(),
    "iou": pyarrow.float64(),
    "threshold_level": pyarrow.int64(),
    "light_on_dark": pyarrow.bool_(),
    "shift_px": pyarrow.list_(pyarrow.float64()),
    "print_from_mesh": pyarrow.list_(pyarrow.list_(pyarrow.float64())),
}
# Columns with another name than the field, because `mesh` and `print` would name a path and a picture.
RENAMED = {"mesh": "mesh_path", "print": "print_path"}
PICTURES = ["print", "print_mask", "depth", "aligned_depth", "aligned_mask"]

export, data = folders()
path = export / "parquet" / "pairs.parquet"
table = pyarrow.parquet.read_table(path)
for name, kind in TYPES.items():
    found = table.schema.field(name).type
    check(found.equals(kind, check_metadata=False), f"parquet: {name} has the type {found}, not {kind}")
rows, lines = table.to_pylist(), read_lines(export / "jsonl" / "pairs.jsonl")
check(len(rows) == len(lines), f"pyarrow reads {len(rows)} rows of {len(lines)}")
check(pandas.read_parquet(path).shape == table.shape, "pandas reads another number of rows or columns than pyarrow")
check_labels("parquet", rows, data)
for row, line in zip(rows, lines):
    for name, value in line.items():
        if name != "files":
            found = row[RENAMED.get(name, name)]
            check(found == value, f"parquet: {line['id']}: {name} is {found!r}, not {value!r}")
    for name in PICTURES:
        picture = Image.open(io.BytesIO(row[name]["bytes"]))
        expected = Image.open(export / "jsonl" / line["files"][name])
        same = picture.mode == expected.mode and np.array_equal(np.asarray(picture), np.asarray(expected))
        check(same, f"parquet: {line['id']}, {line['metric']}: {name} is another picture than in jsonl")
check_landmarks("parquet", data, rows)
