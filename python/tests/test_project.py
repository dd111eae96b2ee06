"""Projects: what the command line writes is read, and the other way round."""

from __future__ import annotations

import contextlib
import copy
import datetime
import errno
import json
import pickle
import shutil
import sqlite3
from collections.abc import Callable
from pathlib import Path

import mocban
import numpy as np
import pytest

from conftest import DemoPair, mocban_command


@pytest.fixture()
def copied(demo: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(demo, tmp_path / "dự án"))


def test_status_settings_and_report_are_those_of_the_command_line(demo: Path) -> None:
    with mocban.open(demo) as project:
        status = json.loads(mocban_command("-C", demo, "status", "--json").stdout)
        assert {key: project.status()[key] for key in ("pairs", "jobs", "stages")} == {
            key: status[key] for key in ("pairs", "jobs", "stages")
        }
        report = json.loads(mocban_command("-C", demo, "report", "--format", "json").stdout)
        assert project.report() == report
        assert project.settings["depth"]["longest_px"] == 512
        assert pickle.loads(pickle.dumps(project)).status() == project.status()


def test_pairs_are_an_arrow_table(demo: Path, tmp_path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    compute = pytest.importorskip("pyarrow.compute")
    project = mocban.open(str(demo))
    table = project.pairs()
    assert isinstance(table, pyarrow.Table) and table.num_rows == 24
    assert set(table["metric"].to_pylist()) == {"relief"}
    assert project.pairs(metric=None).num_rows == 96
    chosen = project.pairs(["id", "iou"], metric="Density", where=compute.field("iou") > 0.5)
    assert chosen.column_names == ["id", "iou"] and 0 < chosen.num_rows <= 24
    mocban_command("-C", demo, "export", "--to", "parquet", "-o", tmp_path / "out")
    exported = pyarrow.parquet.read_table(tmp_path / "out" / "pairs.parquet")
    assert project.pairs(metric=None).equals(exported.replace_schema_metadata(None))


def test_a_stored_alignment_is_that_of_align(demo: Path, pairs: list[DemoPair]) -> None:
    project = mocban.open(demo)
    compared = 0
    for pair in pairs[:8]:
        stored = project.pair(pair.id)
        assert stored.id == pair.id and stored.files["mesh"].samefile(pair.mesh)
        if stored.status != "done":
            with pytest.raises(mocban.ProjectError, match="no alignment"):
                stored.alignment
            continue
        mesh = mocban.read_mesh(pair.mesh, unit=pair.unit)
        found = mocban.align(mesh, pair.print, scanned_face_down=pair.scanned_face_down)
        assert stored.alignment == found and hash(stored.alignment) == hash(found)
        assert stored.print() == mocban.read_print(pair.print)
        np.testing.assert_array_equal(stored.mask("density"), found.results["density"].aligned_mask())
        np.testing.assert_array_equal(stored.overlay(), found.overlay())
        assert stored.history() and stored.depth().dtype == np.float64
        assert len(stored.metrics["relief"]["result_hash"]) == 64
        compared += 1
    assert compared >= 6
    with pytest.raises(mocban.ProjectError, match="nobody") as error:
        project.pair("nobody")
    assert error.value.code == "nothing_selected"


def test_verdicts_have_the_rules_of_the_command_line(copied: Path, pair: DemoPair) -> None:
    project = mocban.open(copied, readonly=False)
    judged = project.pair(pair.id).metrics["relief"]["result_hash"]
    assert project.add_verdict(pair.id, "Relief", "Fail", reason="ANGLE", reviewer="Lan", expect=judged)
    mocban_command("-C", copied, "verdict", "set", pair.id, "pass", "--reviewer", "Minh", "--metric", "density")
    log = project.verdicts()
    assert [(v["reviewer"], v["metric"], v["verdict"]) for v in log] == [
        ("Lan", "relief", "fail"),
        ("Minh", "density", "pass"),
    ]
    assert project.pair(pair.id).metrics["relief"]["verdicts"][0]["reviewer"] == "Lan"
    with pytest.raises(mocban.StaleResult, match="has changed") as stale:
        project.add_verdict(pair.id, "relief", "pass", reviewer="Lan", expect="0" * 64)
    assert stale.value.code == "stale_result"
    for arguments in ({"verdict": "good"}, {"metric": "relif"}, {"reason": "ugly"}, {"expect": "x"}, {"reviewer": ""}):
        wrong = {"metric": "relief", "verdict": "fail", "reviewer": "Lan"} | arguments
        with pytest.raises(mocban.InputError) as error:
            project.add_verdict(pair.id, **wrong)
        assert error.value.code == "usage", arguments
    assert project.verdicts() == log
    readonly = mocban.open(copied)
    for write in (
        lambda: readonly.add_verdict(pair.id, "relief", "pass", reviewer="Lan"),
        lambda: readonly.import_pairs([]),
        lambda: readonly.run(),
    ):
        with pytest.raises(PermissionError, match="readonly=False") as refused:
            write()
        assert isinstance(refused.value, mocban.ReadOnlyProject)
        assert (refused.value.errno, refused.value.filename) == (errno.EACCES, str(copied))


def test_a_third_person_settles_a_conflict(copied: Path, pair: DemoPair) -> None:
    project = mocban.open(copied, readonly=False)

    def settle(reviewer: str, **more: str) -> bool:
        return project.add_verdict(pair.id, "relief", "pass", reviewer=reviewer, adjudicate=True, **more)

    with pytest.raises(mocban.ProjectError, match="no open conflict") as none:
        settle("Hoa")
    assert none.value.code == "nothing_selected"
    project.add_verdict(pair.id, "relief", "pass", reviewer="Lan")
    project.add_verdict(pair.id, "relief", "fail", reviewer="Minh")
    with pytest.raises(mocban.ProjectError, match="no open conflict"):
        settle("Lan")
    with pytest.raises(mocban.StaleResult):
        settle("Hoa", expect="0" * 64)
    assert len(project.verdicts()) == 2
    assert settle("Hoa", expect=project.pair(pair.id).metrics["relief"]["result_hash"])
    last = project.verdicts()[-1]
    assert (last["reviewer"], last["metric"], last["review_order"]) == ("Hoa", "relief", "adjudicate")
    with pytest.raises(mocban.ProjectError, match="no open conflict"):
        settle("Mai")


def test_rows_are_imported_and_run_with_progress(pairs: list[DemoPair], tmp_path: Path) -> None:
    folder = tmp_path / "mới"
    rows = [{"id": p.id, "mesh": p.mesh, "print": p.print, "note": float("nan"), "unit": p.unit} for p in pairs[:3]]
    with pytest.raises(mocban.NotAProject):
        mocban.open(folder)
    project = mocban.Project.create(folder)
    assert project.import_pairs(rows)["added"] == 3
    assert project.import_pairs(iter(rows))["unchanged"] == 3
    fewer = project.import_pairs(rows[:2], replace=True)
    assert fewer["retired"] == 1 and project.status()["pairs"] == 2
    assert project.import_pairs(rows)["restored"] == 1
    moved = [row | {"mesh": p.mesh, "print": p.print} for row, p in zip(rows, pairs[1:4])]
    with pytest.raises(mocban.ProjectError, match="--allow-changed-files"):
        project.import_pairs(moved)
    assert len(project.import_pairs(moved, allow_changed_files=True)["changed"]) == 3
    project.import_pairs(rows, allow_changed_files=True)
    missing = [{"id": 7, "mesh": "no.stl", "print": "no.png"}]
    with pytest.raises(mocban.ProjectError, match="no.stl"):
        project.import_pairs(missing)
    assert project.import_pairs(missing, allow_missing=True)["missing_files"]
    with pytest.raises(mocban.ProjectError, match="line 1"):
        project.import_pairs([{"id": "", "mesh": "a", "print": "b"}])
    events: list[str] = []

    def stop(event: dict) -> object:
        events.append(event["message_type"])
        return event["message_type"] != "pair_done"

    with pytest.raises(mocban.Cancelled):
        project.run(ids=[p.id for p in pairs[:3]], workers=1, progress=stop)
    assert events[0] == "started" and "stage_finished" in events
    with pytest.raises(ZeroDivisionError):
        project.run(progress=lambda event: 1 / 0)
    summary = project.run(workers=2)
    assert summary["left"] == 0 and summary["failed_in_all"] == 1
    assert "no.stl" in project.pair("7").error and project.status()["jobs"]["quarantined"] == 1
    assert project.run()["stages"] == 0
    exported = project.export(tmp_path / "out", ["jsonl", "csv"], metrics=["RELIEF"])
    assert exported["done"] + exported["without_result"] == 4
    assert (tmp_path / "out" / "jsonl" / "pairs.jsonl").exists()


@pytest.mark.parametrize("module", ["pyarrow", "polars", "pandas"])
def test_data_frames_are_imported(module: str, pair: DemoPair, tmp_path: Path) -> None:
    frames = pytest.importorskip(module)
    columns = {"id": [7], "mesh": [str(pair.mesh)], "print": [str(pair.print)], "unit": [None], "page": [12]}
    frame = frames.table(columns) if module == "pyarrow" else frames.DataFrame(columns)
    project = mocban.Project.create(tmp_path / "new")
    assert project.import_pairs(frame)["added"] == 1 and project.pair("7").files["mesh"] == pair.mesh
    assert project.pair("7").meta == {"page": 12}


def test_missing_values_of_pandas_are_left_out(pairs: list[DemoPair], tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    first, second = pairs[:2]
    frame = pandas.DataFrame({"id": ["a", "b"], "mesh": [first.mesh, second.mesh], "print": [first.print, second.print]})
    frame["unit"] = pandas.array(["mm", None], dtype="string")
    frame["scanned_face_down"] = pandas.array([None, True], dtype="boolean")
    frame["count"] = pandas.array([3, None], dtype="Int64")
    frame["when"] = pandas.to_datetime(["2020-01-02", None])
    project = mocban.Project.create(tmp_path / "new")
    assert project.import_pairs(frame)["added"] == 2
    a, b = project.pair("a"), project.pair("b")
    assert a.meta == {"count": 3, "when": "2020-01-02 00:00:00"} and b.meta == {}
    assert (a._detail["unit"], b._detail["unit"]) == ("mm", None)
    assert (a._detail["scanned_face_down"], b._detail["scanned_face_down"]) == (None, True)


def test_wrong_arguments_have_a_sentence(demo: Path, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    project = mocban.open(demo)
    pair = project.pair(project.pairs(["id"])["id"][0].as_py())
    assert pickle.loads(pickle.dumps(pair)).files == pair.files and copy.deepcopy(project) == project
    new = mocban.Project.create(tmp_path / "new")
    wrong: list[tuple[str, Callable[[], object]]] = [
        ("no column 'nope', only id", lambda: project.pairs(["nope"])),
        ("where is no expression", lambda: project.pairs(where="iou > 0.9")),
        ("no metric 'nope'", lambda: project.pairs(metric="nope")),
        ("no metric 'nope'", lambda: pair.mask("nope")),
        ("no result of the metric nope", lambda: pair.overlay("nope")),
        ("formats is empty", lambda: project.export(tmp_path / "e", [])),
        ("nope", lambda: project.export(tmp_path / "e", ["nope"])),
        ("nope", lambda: project.export(tmp_path / "e", metrics=["nope"])),
        ("nope", lambda: project.export(tmp_path / "e", only="nope")),
        ("ids is empty", lambda: mocban.open(demo, readonly=False).run(ids=[])),
        ("the rows are a str", lambda: new.import_pairs("rows.csv")),
        ("the rows are a dict", lambda: new.import_pairs({"id": "a"})),
        ("line 1 of the rows is a int", lambda: new.import_pairs([1])),
        ("no address of a catalog", lambda: mocban.open("mysql://server/x")),
        ("folder is only for an address", lambda: mocban.open(demo, folder=tmp_path)),
    ]
    for sentence, call in wrong:
        with pytest.raises(mocban.InputError, match=sentence):
            call()
    row = {"id": "a", "mesh": pair.files["mesh"], "print": pair.files["print"], "when": datetime.date(2020, 1, 2)}
    assert new.import_pairs([row])["added"] == 1
    assert new.pair("a").meta["when"] == "2020-01-02"
    with pytest.raises(mocban.ProjectError, match="pair a has no alignment: run it"):
        new.pair("a").alignment
    with pytest.raises(mocban.ProjectError, match="/rows"):
        new.import_pairs([{"id": "b", "mesh": "", "print": "x.png"}])


def test_a_result_of_an_unknown_ink_is_damaged(copied: Path, pair: DemoPair) -> None:
    with contextlib.closing(sqlite3.connect(copied / "catalog.sqlite")) as catalog, catalog:
        catalog.execute("UPDATE stage_result SET outcome = json_set(outcome, '$.ink', 9) WHERE outcome ->> '$.ink' >= 0")
    with pytest.raises(mocban.ProjectError, match="interpretation 9 of the print") as error:
        mocban.open(copied).pair(pair.id).alignment
    assert error.value.code == "damaged"


def test_folders_that_are_no_project_are_refused(demo: Path, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError) as missing:
        mocban.open(tmp_path)
    assert (missing.value.errno, missing.value.filename) == (errno.ENOENT, str(tmp_path))
    assert isinstance(missing.value, mocban.NotAProject) and missing.value.code == "no_project"
    other = tmp_path / "other"
    other.mkdir()
    (other / "catalog.sqlite").write_bytes(b"not a database" * 100)
    with pytest.raises(mocban.ProjectError) as damaged:
        mocban.open(other)
    assert "catalog.sqlite" in damaged.value.hint and damaged.value.path == str(other)
    assert pickle.loads(pickle.dumps(damaged.value)).hint == damaged.value.hint
