"""Doc examples, the scripts of `examples/python` and the notebook."""

from __future__ import annotations

import contextlib
import doctest
import importlib
import importlib.util
import io
import json
import os
import pkgutil
import shutil
import subprocess
import sys
from pathlib import Path

import mocban
import pytest

from conftest import DemoPair, mocban_command, program

EXAMPLES = Path(__file__).parents[2] / "examples" / "python"


@pytest.fixture()
def folder(pair: DemoPair, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory of the examples: a pair of files and a project."""
    shutil.copy(pair.mesh, tmp_path / "pair.stl")
    shutil.copy(pair.print, tmp_path / "pair.png")
    mocban_command("demo", tmp_path / "demo", "--pairs", 4)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(folder: Path, script: str, *arguments: str) -> str:
    environment = os.environ | {"PYTHONIOENCODING": "utf-8", "PYTHONPATH": os.pathsep.join(sys.path), "MPLBACKEND": "agg"}
    command = [sys.executable, EXAMPLES / script, *arguments]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, timeout=600, encoding="utf-8")
    assert done.returncode == 0 or "install matplotlib" in done.stderr, done.stderr
    return done.stdout


def test_doc_examples_run(folder: Path, block: Path) -> None:
    for file in block.iterdir():
        shutil.copy(file, folder)
    names = [module.name for module in pkgutil.iter_modules(mocban.__path__) if module.name != "_native"]
    modules = [mocban, *(importlib.import_module(f"mocban.{name}") for name in names)]
    results = [doctest.testmod(module) for module in modules]
    assert sum(result.failed for result in results) == 0
    assert sum(result.attempted for result in results) > 25


def test_arrays_of_trimesh_are_aligned(folder: Path) -> None:
    pytest.importorskip("trimesh")
    pytest.importorskip("PIL")
    output = run(folder, "align_arrays.py", "pair.stl", "pair.png")
    strokes, beside = (float(word.strip(",\n")) for word in output.split() if word.strip(",\n").isdigit())
    assert strokes < beside and (folder / "aligned" / "alignment.json").exists()


def test_a_folder_is_aligned(folder: Path) -> None:
    data = folder / "demo" / "data"
    assert "4 of 4 pairs are aligned" in run(folder, "align_folder.py", str(data / "meshes"), str(data / "prints"))
    drawn = importlib.util.find_spec("matplotlib") is not None
    assert (folder / "confidence.png").exists() == drawn


def test_doubtful_pairs_are_judged(folder: Path) -> None:
    for module in ("pyarrow", "polars", "PIL"):
        pytest.importorskip(module)
    assert "3 verdicts are recorded" in run(folder, "judge_doubtful.py", "demo", "Lan")
    assert len(list(folder.glob("*-0*.png"))) == 3


def test_a_dataset_for_pytorch(folder: Path) -> None:
    for module in ("pyarrow", "torch"):
        pytest.importorskip(module)
    assert "128, 128)" in run(folder, "torch_dataset.py", "demo")


def test_the_notebook_runs(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pyarrow")
    shutil.rmtree(folder / "demo")
    monkeypatch.setenv("PATH", f"{Path(program()).parent}{os.pathsep}{os.environ['PATH']}")
    notebook = json.loads((EXAMPLES / "first_hour.ipynb").read_text(encoding="utf-8"))
    names: dict[str, object] = {}
    for cell in notebook["cells"]:
        assert not cell.get("outputs"), "a notebook is committed without outputs"
        if cell["cell_type"] == "code":
            with contextlib.redirect_stdout(io.StringIO()):
                exec(compile("".join(cell["source"]), cell["id"], "exec"), names)
    assert names["found"].status == "aligned"
