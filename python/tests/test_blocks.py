"""Whole blocks with their pages."""

from __future__ import annotations

import errno
import json
import logging
import pickle
from pathlib import Path

import mocban
import numpy as np
import pytest
from conftest import mocban_command


@pytest.fixture(scope="module")
def aligned(block: Path, tmp_path_factory: pytest.TempPathFactory) -> mocban.BlockAlignment:
    """A block that is aligned from its files, in a project of its own."""
    folder = tmp_path_factory.mktemp("aligned") / "khối"
    labels = block / "labels.json"
    return mocban.align_block(block / "block.ply", block / "page.jpg", labels=labels, folder=folder)


def test_characters_of_files_are_those_of_the_project(aligned: mocban.BlockAlignment, block: Path) -> None:
    assert aligned.status == "done" and aligned.error is None
    assert aligned.agreement is not None and aligned.agreement > 0.8
    assert [one.label for one in aligned.characters] == ["c01-r01", "c01-r02", "c01-r03", "c01-r04"]
    first = aligned.characters[0]
    assert first.pair == "block_c01-r01" and first.alignment == aligned.project.pair("block_c01-r01").alignment
    assert first.alignment.confidence is not None and first.alignment.confidence > 0.9
    # The map of the block leads into the box of the character.
    mesh = mocban.read_mesh(aligned.project.pair(first.pair).files["mesh"])
    assert first.page_from_mesh is not None
    pixels = mesh.vertices.mean(axis=0) @ first.page_from_mesh[:2, :3].T + first.page_from_mesh[:2, 3]
    left, top, right, bottom = first.box
    assert left < pixels[0] < right and top < pixels[1] < bottom
    labels = block / "labels.json"
    folder = aligned.project.folder
    assert mocban.align_block(block / "block.ply", block / "page.jpg", labels=labels, folder=folder) == aligned
    again = aligned.project.block("block")
    assert again == aligned and hash(again) == hash(aligned)
    assert pickle.loads(pickle.dumps(aligned)) == aligned
    with pytest.raises(mocban.ProjectError, match="is a pair, not a block"):
        aligned.project.block("block_c01-r01")


def test_arrays_give_the_result_of_their_files(aligned: mocban.BlockAlignment, block: Path) -> None:
    mesh, page = mocban.read_mesh(block / "block.ply"), mocban.read_print(block / "page.jpg")
    labels = [{"box": one.box, "label": one.label, "character": one.character} for one in aligned.characters]
    events: list[str] = []
    found = mocban.align_block(
        mesh, page.image, labels=labels, workers=1, progress=lambda event: events.append(event["message_type"])
    )
    assert events.count("pair_done") == 4 and found.agreement == aligned.agreement
    for one, other in zip(found.characters, aligned.characters):
        assert (one.label, one.character, one.box, one.confidence) == (
            other.label,
            other.character,
            other.box,
            other.confidence,
        )
        assert np.array_equal(one.page_from_mesh, other.page_from_mesh)
        assert one.alignment == other.alignment
    pair = found.project.pair(found.characters[0].pair)
    for value in (found, found.characters[0], found.characters, found.project, pair):
        with pytest.raises(TypeError, match="temporary folder"):
            pickle.dumps(value)
    assert pickle.loads(pickle.dumps(aligned.characters)) == aligned.characters
    folder = found.project.folder
    assert folder.exists()
    del found, one, pair, value
    assert not folder.exists()


def test_a_character_keeps_the_temporary_project(block: Path) -> None:
    labels = block / "labels.json"
    first = mocban.align_block(block / "block.ply", block / "page.jpg", labels=labels).characters[0]
    assert first.alignment.status == "aligned"


def test_warnings_of_an_import_are_logged(block: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    project = mocban.Project.create(tmp_path / "new")
    with caplog.at_level(logging.WARNING, logger="mocban"):
        first = project.import_block(block / "block.ply", block / "page.jpg", id="a")
        assert first == {"added": 1, "changed": [], "unchanged": 0} and not caplog.records
        project.import_block(block / "block.ply", block / "page.jpg", id="b")
    assert "blocks with the same scan and page as one of the project: 1, first b, as a" in caplog.text


def test_another_import_keeps_the_metadata_of_a_list(block: Path, tmp_path: Path) -> None:
    project = mocban.Project.create(tmp_path / "new")
    files = (block / "block.ply", block / "page.jpg")
    row = {"block": "a", "mesh": str(files[0]), "page": str(files[1]), "shelfmark": "R.4"}
    blocks = tmp_path / "blocks.jsonl"
    blocks.write_text(json.dumps(row), encoding="utf-8")
    mocban_command("-C", project.folder, "import", blocks)
    assert project.block("a").meta == {"shelfmark": "R.4"}
    assert project.import_block(*files, id="a", side="front")["changed"] == ["a"]
    assert project.block("a").meta == {"shelfmark": "R.4"}


def test_wrong_files_are_named(block: Path, demo: Path, tmp_path: Path) -> None:
    files = {"mesh": block / "block.ply", "page": block / "page.jpg", "labels": block / "labels.json"}
    project = mocban.Project.create(tmp_path / "new")
    for name in files:
        wrong = files | {name: tmp_path / "no.ply"}
        for call in (mocban.align_block, project.import_block):
            with pytest.raises(mocban.InputNotFound, match=f"no.ply is not there; give the file of the {name}") as error:
                call(**wrong)
            assert (error.value.code, error.value.errno) == ("not_found", errno.ENOENT)
            assert error.value.path == error.value.filename == str(tmp_path / "no.ply")
    assert not (tmp_path / "new").exists()
    with pytest.raises(mocban.UnitError):
        project.import_block(files["mesh"], files["page"], unit="inch")
    with pytest.raises(mocban.InputError, match="Left"):
        project.import_block(files["mesh"], files["page"], side="Left")
    other = tmp_path / "other"
    other.mkdir()
    (other / "notes.txt").touch()
    for folder in (other, demo):
        with pytest.raises(mocban.ProjectError, match="something else than a block"):
            mocban.align_block(block / "block.ply", block / "page.jpg", folder=folder)
    with pytest.raises(mocban.InputError, match="left < right"):
        mocban.align_block(block / "block.ply", block / "page.jpg", labels=[{"box": (5, 5, 1, 1)}])
    with pytest.raises(mocban.Error, match="has no box"):
        mocban.align_block(block / "block.ply", block / "page.jpg", labels=[{"label": "a"}])
    with pytest.raises(mocban.MeshError, match="give a mocban.Mesh"):
        mocban.align_block(object(), block / "page.jpg")  # type: ignore[arg-type]
    (tmp_path / "block.ply").write_bytes(b"ply\n")
    broken = mocban.align_block(tmp_path / "block.ply", block / "page.jpg")
    assert broken.status != "done" and broken.error is not None and broken.characters == ()
    with pytest.raises(mocban.Refused, match="the block is not aligned"):
        mocban.align_block(tmp_path / "block.ply", block / "page.jpg", strict=True)
