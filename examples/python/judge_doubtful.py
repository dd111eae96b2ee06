"""Looks for doubtful results of a project, saves their overlays and records verdicts on them.

Install the wheel of a release, then:

    pip install pyarrow polars pillow
    python judge_doubtful.py demo Lan
"""

import sys

import mocban
import polars as pl
from PIL import Image

project = mocban.open(sys.argv[1], readonly=False)
pairs = pl.from_arrow(project.pairs(["id", "character", "confidence", "iou", "result_hash"]))
doubtful = pairs.drop_nulls("confidence").sort("confidence").head(3)
print(doubtful)

for row in doubtful.iter_rows(named=True):
    Image.fromarray(project.pair(row["id"]).overlay()).save(f"{row['id']}.png")
    # A person decides here; this example takes the numbers.
    verdict = "pass" if row["iou"] > 0.6 else "unsure"
    project.add_verdict(row["id"], "relief", verdict, reviewer=sys.argv[2], expect=row["result_hash"])
print(f"{len(project.verdicts())} verdicts are recorded")
