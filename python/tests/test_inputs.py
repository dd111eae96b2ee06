"""Arrays and files of every kind: used as they are meant, or refused with the right exception."""

from __future__ import annotations

import errno
import logging
import pickle
from pathlib import Path
from typing import Any

import mocban
import numpy as np
import pytest

from conftest import DemoPair

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.5]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])


@pytest.mark.parametrize(
    "vertices",
    [
        CORNERS,
        CORNERS.tolist(),
        np.asfortranarray(CORNERS),
        np.repeat(CORNERS, 2, axis=0)[::2],
        np.hstack((CORNERS, CORNERS))[:, 3:],
        CORNERS.astype(np.float32),
        CORNERS.astype(np.float16),
        CORNERS.astype(">f8"),
        CORNERS.astype(">f4"),
        (CORNERS * 2).astype(np.int16) / 2,
    ],
)
@pytest.mark.parametrize("dtype", [np.int64, np.uint32, np.int32, ">i4", np.uint8])
def test_arrays_of_every_layout_are_copied(vertices: object, dtype: object) -> None:
    faces = FACES.astype(dtype)
    mesh = mocban.Mesh(vertices, np.asfortranarray(faces))
    assert np.array_equal(mesh.vertices, CORNERS) and mesh.vertices.dtype == np.float64
    assert np.array_equal(mesh.faces, FACES) and mesh.faces.dtype == np.uint32
    assert mesh == mocban.Mesh(CORNERS, FACES) and mesh.unit == "mm"


def test_the_copy_is_apart_from_the_array() -> None:
    vertices, faces = CORNERS.copy(), FACES.copy()
    vertices.setflags(write=False)
    mesh = mocban.Mesh(vertices, faces)
    faces[0] = 3
    assert np.array_equal(mesh.faces, FACES)
    with pytest.raises(ValueError):
        mesh.vertices[0] = 7.0
    with pytest.raises(AttributeError):
        mesh.unit = "cm"  # type: ignore[misc]
    assert pickle.loads(pickle.dumps(mesh)) == mesh
    points = mocban.Mesh(CORNERS, unit=None)
    assert points.faces is None and points.unit is None and points != mesh
    assert repr(points) == "<mocban.Mesh: 4 vertices, 0 faces, unit not known>"


@pytest.mark.parametrize(
    ("vertices", "faces", "says"),
    [
        (np.zeros((0, 3)), None, "no vertices"),
        ([], None, r"shape \(0,\)"),
        (np.zeros((4, 2)), None, r"shape \(4, 2\); give an array of shape \(N, 3\)"),
        (np.zeros(6), None, r"shape \(6,\)"),
        (np.zeros((2, 2, 3)), None, "shape"),
        (np.zeros((4, 3), dtype=complex), None, "complex128"),
        (np.array([["a"] * 3]), None, "<U1"),
        ("scan.stl", None, "path 'scan.stl'"),
        (None, None, "are None"),
        ([[0, 0, 0], [1, 1]], None, "no array"),
        (np.ma.masked_equal(CORNERS, 1.5), None, "masked"),
        (np.where(CORNERS == 1.5, np.nan, CORNERS), FACES, r"vertex 3 \(counted from 0\) has the coordinate NaN"),
        (np.where(CORNERS == 1.5, np.inf, CORNERS).astype("f4"), FACES, "coordinate inf"),
        (CORNERS, FACES + 2, "face 0 refers to vertex 4, but there are 4 vertices"),
        (CORNERS, FACES - 1, "vertex -1"),
        (CORNERS, FACES + 2**33, "vertex 85899345"),
        (CORNERS, FACES.astype(float), "type float64; give integers"),
        (CORNERS, FACES.astype(bool), "type bool; give integers"),
        (CORNERS, FACES[:, :2], r"shape \(2, 2\)"),
        (CORNERS, [0, 1, 2], r"shape \(3,\)"),
    ],
)
def test_arrays_that_are_no_mesh_are_refused(vertices: object, faces: object, says: str) -> None:
    with pytest.raises(mocban.MeshError, match=says) as error:
        mocban.Mesh(vertices, faces)
    assert isinstance(error.value, ValueError) and error.value.code == "bad_input" and error.value.path is None


def test_units_are_checked(pair: DemoPair) -> None:
    with pytest.raises(mocban.UnitError, match="inch") as error:
        mocban.Mesh(CORNERS, unit="inch")
    assert error.value.code == "unknown_unit"
    assert mocban.Mesh(CORNERS, unit="MM").unit == "mm"
    mesh = mocban.read_mesh(pair.mesh, unit="M")
    assert "m long" in mesh.warnings[0]
    with pytest.raises(mocban.UnitError, match="perhaps mm") as error:
        mocban.align(mesh, pair.print)
    assert error.value.path == str(pair.mesh)


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, ">u2"])
def test_images_of_every_layout_are_copied(channels: int, dtype: object) -> None:
    white = np.iinfo(np.dtype(dtype)).max
    image = np.random.default_rng(7).integers(0, white, (7, 5, channels), endpoint=True).astype(dtype)
    if channels in (2, 4):
        image[:, :, -1] = white
    expected = image[:, :, : 3 if channels > 2 else 1].astype(np.uint32) * (65535 // white)
    strided = np.repeat(np.repeat(image, 2, axis=0), 3, axis=1)[::2, ::3]
    for layout in (image, np.asfortranarray(image), strided, image[::-1][::-1]):
        copied = mocban.Print(layout)
        assert copied.size == (5, 7) and copied.image.shape == (7, 5, 3)
        assert np.array_equal(copied.image16, np.broadcast_to(expected, (7, 5, 3)))
        assert pickle.loads(pickle.dumps(copied)) == copied
    if channels == 1:
        assert mocban.Print(image[:, :, 0]) == mocban.Print(image)


@pytest.mark.parametrize(
    ("image", "says"),
    [
        (np.zeros((0, 4), dtype=np.uint8), "no pixels"),
        (np.zeros((4, 4)), "float64; give uint8"),
        (np.zeros((4, 4), dtype=bool), "bool; give uint8"),
        (np.zeros((4, 4), dtype=np.int64), "int64"),
        (np.zeros(9, dtype=np.uint8), r"shape \(9, 1\)|shape \(9,\)"),
        (np.zeros((4, 4, 5), dtype=np.uint8), r"shape \(4, 4, 5\)"),
        (np.zeros((2, 4, 4, 3), dtype=np.uint8), "shape"),
        ("print.png", "path"),
        (None, "are None"),
    ],
)
def test_arrays_that_are_no_image_are_refused(image: object, says: str) -> None:
    with pytest.raises(mocban.ImageError, match=says) as error:
        mocban.Print(image)
    assert error.value.code == "bad_input"


def test_images_of_pil_have_the_meaning_of_their_mode() -> None:
    image = pytest.importorskip("PIL.Image")
    for mode in ("P", "1", "CMYK", "LAB", "HSV", "YCbCr"):
        with pytest.raises(mocban.ImageError, match="convert"):
            mocban.Print(image.new(mode, (4, 4)))
    assert mocban.Print(image.new("RGB", (4, 4), "white")).image.min() == 255


def test_the_resolution_of_a_file_is_read(tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    picture = image.new("RGB", (12, 8), "white")

    def exif(orientation: int, dpi: tuple[float, float] | None = None) -> Any:
        block = image.Exif()
        block[274] = orientation
        if dpi is not None:
            block[282], block[283], block[296] = dpi[0], dpi[1], 2
        return block

    stated = (300, 600)
    saved: list[tuple[str, dict[str, Any], tuple[float, float] | None]] = [
        ("a.png", {"dpi": stated}, stated),
        ("b.png", {"exif": exif(1, stated)}, stated),
        ("c.png", {"dpi": stated, "exif": exif(6)}, stated[::-1]),
        ("a.jpg", {"dpi": stated}, stated),
        ("b.jpg", {"exif": exif(1, stated)}, stated),
        ("c.jpg", {"dpi": stated, "exif": exif(8)}, stated[::-1]),
        ("a.tif", {"dpi": stated}, stated),
        ("b.tif", {"resolution_unit": "cm", "x_resolution": 100, "y_resolution": 200}, (254, 508)),
        ("c.tif", {"dpi": stated, "exif": exif(5)}, stated[::-1]),
        ("d.png", {}, None),
        ("d.jpg", {}, None),
        ("d.tif", {}, None),
    ]
    for name, options, expected in saved:
        picture.save(tmp_path / name, **options)
        read = mocban.read_print(tmp_path / name)
        assert read.size == ((8, 12) if name.startswith("c") else (12, 8))
        assert read.dpi == (None if expected is None else pytest.approx(expected, rel=1e-4)), name
        plain = mocban.Print(read.image)
        assert plain.dpi is None and plain == read and hash(plain) == hash(read)
        assert pickle.loads(pickle.dumps(read)) == read


def test_files_are_refused_by_kind(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    folder = tmp_path / "thư mục"
    folder.mkdir()
    letter = folder / "chữ.stl"
    letter.write_text("Dear reader,\nthis is a letter.\n", encoding="utf-8")
    for read, kind in ((mocban.read_mesh, mocban.MeshError), (mocban.read_print, mocban.ImageError)):
        with pytest.raises(kind, match="the file is text") as error:
            read(letter)
        assert error.value.code == "bad_input" and error.value.path == str(letter)
        assert str(letter) in error.value.hint and str(error.value) == error.value.hint
        with pytest.raises(FileNotFoundError, match="missing.stl") as missing:
            read(str(folder / "missing.stl"))
        assert isinstance(missing.value, mocban.InputError) and missing.value.code == "not_found"
        path = str(folder / "missing.stl")
        assert (missing.value.errno, missing.value.filename) == (errno.ENOENT, path)
        assert pickle.loads(pickle.dumps(missing.value)).errno == errno.ENOENT
        with pytest.raises(mocban.InputError) as directory:
            read(folder)
        assert directory.value.code == "unreadable"
        copied = pickle.loads(pickle.dumps(error.value))
        assert (copied.code, copied.path, str(copied)) == (error.value.code, error.value.path, str(error.value))
    with pytest.raises(mocban.MeshError, match="mocban.Mesh"):
        mocban.align(np.zeros((3, 3)), np.zeros((4, 4), dtype=np.uint8))
    with pytest.raises(mocban.InputError, match="limit of 9 .limits.mesh.max_bytes"):
        mocban.align(letter, letter, settings=mocban.settings(limits={"mesh.max_bytes": 9}))
    assert not caplog.records and sorted(path.name for path in folder.iterdir()) == ["chữ.stl"]


def test_settings_are_checked_and_compared() -> None:
    default = mocban.settings()
    assert default == mocban.settings("default") and hash(default) == hash(mocban.settings())
    changed = mocban.settings(depth={"longest_px": np.int64(256)}, fit__curved_blocks=False)
    assert changed["depth.longest_px"] == 256 and changed.to_dict()["fit"]["curved_blocks"] is False
    assert changed != default and pickle.loads(pickle.dumps(changed)) == changed
    assert eval(repr(changed)) == changed
    for wrong, says in [
        ({"preset": "papr"}, "papr"),
        ({"depth__longest": 7}, "there is no setting depth.longest"),
        ({"depth__longest_px": "seven"}, "depth.longest_px = \"seven\""),
        ({"depth__longest_px": 7}, "outside the range"),
        ({"depth__longest_px": None}, "give a number"),
        ({"longest_px": 7}, "section__key"),
        ({"run__workers": 2}, "belongs to a project"),
    ]:
        with pytest.raises(mocban.SettingsError, match=says) as error:
            mocban.settings(**wrong)
        assert isinstance(error.value, ValueError) and error.value.code == "settings"


def test_warnings_go_to_the_logger(pair: DemoPair, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, logger="mocban"):
        mocban.read_mesh(pair.mesh, unit="m")
    assert "perhaps mm" in caplog.text


def test_inputs_that_are_no_arrays_have_a_sentence() -> None:
    wrong: list[tuple[str, object]] = [
        ("pixels are None.*was the file read", None),
        ("bytes of a file", b"\x89PNG"),
        ("limits.image.max_pixels", np.broadcast_to(np.uint8(255), (100_000, 100_000))),
        ("255 . ~mask", np.zeros((40, 30), dtype=bool)),
        ("round", np.zeros((40, 30))),
    ]
    for sentence, image in wrong:
        with pytest.raises(mocban.ImageError, match=sentence):
            mocban.Print(image)  # type: ignore[arg-type]
    few = mocban.settings(limits__image__max_pixels=100)
    with pytest.raises(mocban.ImageError, match=r"limits.image.max_pixels \(100\)"):
        mocban.align(mocban.Mesh(CORNERS, FACES), np.zeros((20, 20), dtype=np.uint8), settings=few)
    assert mocban.Print([[0, 255]] * 2) == mocban.Print(np.array([[0, 255]] * 2, dtype=np.uint8))
    mesh = mocban.Mesh(CORNERS, FACES)
    with pytest.raises(mocban.MeshError, match="give its arrays"):
        mocban.Mesh(mesh)  # type: ignore[arg-type]
    with pytest.raises(mocban.MeshError, match="give a number"):
        mocban.Mesh.from_heights(np.zeros((3, 3)), mm_per_px="a")  # type: ignore[arg-type]
    with pytest.raises(mocban.UnitError, match="that of the mesh is mm"):
        mocban.align(mesh, [[0, 255]] * 2, unit="in")
    with pytest.raises(mocban.SettingsError, match="given twice"):
        mocban.settings(depth={"longest_px": 256}, depth__longest_px=128)
    assert "depth.longest_px" in mocban.settings() and "depth" in list(mocban.settings())
