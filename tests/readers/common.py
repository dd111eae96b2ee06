"""What the scripts of the readers share: checks, labels, truth, and the height model.

Each script opens an export in one reader and compares numbers: SCRIPT EXPORT DATA. EXPORT holds a folder per format,
DATA is the data folder of `mocban demo` with the imported list as `pairs.csv`. A wrong number ends the script with one
sentence and code 1, a missing module or program with code 77.
"""

import csv
import json
import os
import shutil
import sys
import traceback
from pathlib import Path

SKIPPED = 77


def skip(text):
    """Ends the script because the reader is not installed."""
    print(f"skipped: {text}", flush=True)
    os._exit(SKIPPED)


def _end(kind, error, trace):
    """Turns any error into one sentence."""
    if issubclass(kind, ImportError) and error.name != "common":
        skip(" ".join(str(error).split()))
    place = traceback.extract_tb(trace)[-1]
    print(f"{kind.__name__} in {Path(place.filename).name}, line {place.lineno}: {' '.join(str(error).split())}")


sys.excepthook = _end

import numpy as np  # noqa: E402


def check(condition, text):
    """Ends the script with a sentence unless the condition holds."""
    if not condition:
        print(text)
        sys.exit(1)


def folders():
    """Returns the folders of the export and of the data."""
    check(len(sys.argv) == 3, f"usage: {sys.argv[0]} EXPORT DATA")
    return Path(sys.argv[1]), Path(sys.argv[2])


def program(*names):
    """Returns the path of the first program that is installed."""
    found = [path for path in map(shutil.which, names) if path]
    return found[0] if found else skip(f"{names[0]} is not installed")


def read_lines(path):
    """Returns the lines of a JSON Lines file."""
    with open(path, encoding="utf-8") as file:
        return [json.loads(line) for line in file]


def single_results(export, name):
    """Returns the lines of a format that shows one result per pair, by id."""
    lines = {line["id"]: line for line in read_lines(export / name / "pairs.jsonl")}
    check(lines and all(line["status"] == "done" for line in lines.values()), f"{name}: a pair has no result")
    return lines


def check_labels(name, rows, data):
    """Checks that dicts hold each pair of the list with its labels, and that no block is in two splits."""
    with open(data / "pairs.csv", encoding="utf-8") as file:
        expected = {row["id"]: row for row in csv.DictReader(file)}
    check({row["id"] for row in rows} == expected.keys(), f"{name}: the pairs are not those of pairs.csv")
    splits = {}
    for row in rows:
        for field in ("character", "block"):
            stated = expected[row["id"]][field]
            check(row[field] == stated, f"{name}: {row['id']}: {field} is {row[field]!r}, not {stated!r}")
        splits.setdefault(row["block"], set()).add(row["split"])
    check(all(len(parts) == 1 for parts in splits.values()), f"{name}: a block is in two splits: {splits}")
    parts = set.union(*splits.values())
    check(parts == {"train", "validation", "test"}, f"{name}: the splits are {parts}")


def source(data, folder, identifier):
    """Returns the path of the mesh or print of a pair."""
    return next((data / folder).glob(f"{identifier}.*"))


def apply(matrix, points):
    """Applies a matrix with one more column than the points have coordinates to points in rows."""
    matrix = np.asarray(matrix, float)
    return np.asarray(points) @ matrix[:, :-1].T + matrix[:, -1]


def mm_per_mesh_unit(line):
    """Returns the factor of lengths: 1 if the unit is unknown."""
    return line["mm_per_mesh_unit"] or 1


def heights_mm(line, points):
    """Returns the heights of mesh points over the fitted surface, by `height_from_mesh`."""
    x, y, z = apply(line["height_from_mesh"]["plane_from_mesh"], points).T
    c = line["height_from_mesh"]["curvature"]
    return (z - (c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y)) * mm_per_mesh_unit(line)


def check_landmarks(name, data, lines, through=None):
    """Checks where landmarks of the mesh land on the print, as a share of the character's height.

    `through` maps a line and mesh points to print pixels by means of the exported files, which must follow
    `print_from_mesh` to 0.05 %. The median pair must lie within 0.3 % of the truth.
    """
    truths = {truth["id"]: truth for truth in read_lines(data / "truth.jsonl")}
    errors = []
    for line in lines:
        truth = truths[line["id"]]
        points, height = np.array(truth["landmarks"]), truth["char_height_px"]
        stated, true = (apply(one["print_from_mesh"], points)[:, :2] for one in (line, truth))
        found = stated if through is None else through(line, points)
        own = np.linalg.norm(found - stated, axis=1).max() / height
        check(own < 5e-4, f"{name}: {line['id']}: landmarks are {own:.3%} of the height from print_from_mesh")
        errors.append(np.linalg.norm(found - true, axis=1).mean() / height)
    check(np.median(errors) < 3e-3, f"{name}: landmarks are {np.median(errors):.3%} of the height from the truth")
    print(f"{name}: {len(errors)} pairs, landmarks {np.median(errors):.3%} of the height from the truth (median)")
