"""Reads the tables of `csv` in pandas, joins them, and compares it with the lines of `jsonl`."""

from common import apply, check, check_labels, check_landmarks, folders, read_lines
import numpy as np
import pandas

NUMBERS = ["threshold_depth", "scale", "iou", "iou_box", "dice", "ssim", "nl_ssim", "confidence", "height_per_level"]


def matrix(row, name, rows, columns):
    """Returns a matrix from its columns."""
    return [[row[f"{name}_{i}_{j}"] for j in range(1, columns + 1)] for i in range(1, rows + 1)]


def stated_verdict(verdict):
    """Returns the text of a verdict in a cell."""
    reason = f" ({verdict['reason']})" if verdict["reason"] else ""
    return f"{verdict['reviewer']}={verdict['verdict']}{reason}"


export, data = folders()
path = export / "csv" / "pairs.csv"
# pandas would turn a column of the user with `true` and `false` into booleans.
texts = {name: str for name in pandas.read_csv(path, nrows=0) if name == "id" or name.startswith("meta_")}
table = pandas.read_csv(path, dtype=texts, keep_default_na=False, na_values=dict.fromkeys(NUMBERS, ""))
first = ["id", "character", "block", "metric", "verdict", "confidence"]
check(list(table)[:6] == first, f"the table begins with {list(table)[:6]}")
matrices = pandas.read_csv(export / "csv" / "matrices.csv", dtype={"id": str}, keep_default_na=False)
table = table.merge(matrices, on=["id", "metric"], how="left", validate="one_to_one")
lines = read_lines(export / "jsonl" / "pairs.jsonl")
check(len(table) == len(lines), f"pandas reads {len(table)} rows of {len(lines)}")
check(all(table[name].dtype == np.float64 for name in NUMBERS), f"pandas reads the types {table[NUMBERS].dtypes.to_dict()}")
rows = table.to_dict("records")
check_labels("csv", rows, data)
for row, line in zip(rows, lines):
    check((row["id"], row["metric"]) == (line["id"], line["metric"]), f"pandas reads a row of {row['id']} in another place")
    for name in NUMBERS:
        check(np.isclose(row[name], line[name], rtol=1e-12, atol=0), f"{row['id']}: {name} is {row[name]}, not {line[name]}")
    for name, value in line["meta"].items():
        check(row[f"meta_{name}"] == value, f"{row['id']}: the column {name!r} is {row[f'meta_{name}']!r}, not {value!r}")
    stated = "; ".join(stated_verdict(one) for one in line["verdicts"])
    found = row["verdicts"]
    check(found == stated, f"{row['id']}: the verdicts are {found!r}, not {stated!r}")
    row["print_from_mesh"] = matrix(row, "print_from_mesh", 3, 4)
    same = np.allclose(row["print_from_mesh"], line["print_from_mesh"], rtol=1e-12, atol=0)
    check(same, f"{row['id']}: print_from_mesh differs")
check_landmarks("csv", data, rows)
