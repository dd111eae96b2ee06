"""Demo pairs, and the program that made them."""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest


class DemoPair(NamedTuple):
    id: str
    mesh: Path
    print: Path
    unit: str | None
    scanned_face_down: bool | None


def program() -> str:
    """Return the program: that of MOCBAN_BIN, or the one that the wheel installed."""
    named = os.environ.get("MOCBAN_BIN")
    beside = Path(sys.executable).parent / ("mocban.exe" if os.name == "nt" else "mocban")
    found = named or (str(beside) if beside.exists() else shutil.which("mocban"))
    assert found, "the program mocban is not installed; MOCBAN_BIN names it"
    return found


def mocban_command(*arguments: object, check: bool = True) -> subprocess.CompletedProcess[str]:
    command = [program(), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", timeout=600)
    assert not check or done.returncode == 0, (command, done.stdout, done.stderr)
    return done


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project of 24 demo pairs that was run. Tests copy it before they change it."""
    folder = tmp_path_factory.mktemp("demo") / "dự án"
    mocban_command("demo", folder, "--pairs", 24, "--seed", 7)
    return folder


@pytest.fixture(scope="session")
def pairs(demo: Path) -> list[DemoPair]:
    data = demo / "data"
    face_down = {"": None, "true": True, "false": False}
    with open(data / "manifest.csv", encoding="utf-8", newline="") as rows:
        return [
            DemoPair(
                row["id"],
                data / row["mesh"],
                data / row["print"],
                row["unit"] or None,
                face_down[row["scanned_face_down"]],
            )
            for row in csv.DictReader(rows)
        ]


@pytest.fixture()
def pair(pairs: list[DemoPair]) -> DemoPair:
    """A pair of an STL file and an 8-bit PNG file."""
    return next(p for p in pairs if p.mesh.suffix == ".stl" and p.print.suffix == ".png")


@pytest.fixture(scope="session")
def block(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with ``block.ply``, ``page.jpg``, and ``labels.json`` with four of its boxes."""
    folder = tmp_path_factory.mktemp("block")
    mocban_command("demo", folder / "demo", "--block=half-page", "--spacing", 0.4, "--no-run")
    data = folder / "demo" / "data"
    via = json.loads((data / "labels.json").read_text(encoding="utf-8"))
    (page,) = via["_via_img_metadata"].values()
    boxes = [region["shape_attributes"] | region["region_attributes"] for region in page["regions"][:4]]
    rows = [
        {
            "x_min": box["x"],
            "y_min": box["y"],
            "x_max": box["x"] + box["width"],
            "y_max": box["y"] + box["height"],
            "id": box["name"],
            "character": box["character"],
        }
        for box in boxes
    ]
    (data / "labels.json").write_text(json.dumps(rows), encoding="utf-8")
    return data
