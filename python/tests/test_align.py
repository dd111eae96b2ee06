"""`align` and its result."""

from __future__ import annotations

import copy
import json
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import mocban
import numpy as np
import pytest

from conftest import DemoPair, mocban_command


def command_line(pair: DemoPair, folder: Path | None = None) -> dict:
    options = ["--unit", pair.unit] if pair.unit else []
    if pair.scanned_face_down is not None:
        options += ["--scanned-face-down", str(pair.scanned_face_down).lower()]
    if folder:
        options += ["-o", folder]
    return json.loads(mocban_command("align", pair.mesh, pair.print, "--json", *options, check=False).stdout)


def assert_same(found: mocban.Alignment, expected: dict) -> None:
    assert found.status == expected["status"]
    assert found.print_from_mesh.tolist() == expected["print_from_mesh"]
    for name in ("confidence", "rotation_deg", "scale", "mirrored", "side"):
        assert getattr(found, name) == expected[name], name
    assert list(found.shift_px) == expected["shift_px"]
    assert set(found.results) == set(expected["results"])
    for name, numbers in expected["results"].items():
        assert {key: getattr(found.results[name], key) for key in numbers} == numbers


def test_arrays_give_the_result_of_the_command_line_bit_for_bit(pairs: list[DemoPair]) -> None:
    assert len(pairs) == 24
    for pair in pairs:
        expected = command_line(pair)
        mesh, image = mocban.read_mesh(pair.mesh), mocban.read_print(pair.print)
        arrays = mocban.Mesh(np.array(mesh.vertices), np.array(mesh.faces), unit=pair.unit)
        for pixels in (image.image16, image.image if pair.print.suffix == ".jpg" else image):
            found = mocban.align(arrays, pixels, scanned_face_down=pair.scanned_face_down)
            assert_same(found, expected)


def test_files_are_those_of_the_command_line(pair: DemoPair, tmp_path: Path) -> None:
    expected = command_line(pair, tmp_path / "cli")
    mesh = mocban.read_mesh(pair.mesh, unit=pair.unit)
    found = mocban.align(mesh, os.fspath(pair.print), scanned_face_down=pair.scanned_face_down)
    assert_same(found, expected)
    found.save(tmp_path / "saved")
    found.save(str(tmp_path / "saved"))
    names = sorted(path.name for path in (tmp_path / "cli").iterdir())
    assert names == sorted(path.name for path in (tmp_path / "saved").iterdir())
    for name in names:
        assert (tmp_path / "cli" / name).read_bytes() == (tmp_path / "saved" / name).read_bytes(), name
    (tmp_path / "saved" / "mine.txt").write_text("mine")
    with pytest.raises(mocban.ProjectError, match="mine.txt") as error:
        found.save(tmp_path / "saved")
    assert error.value.code == "usage"


def test_masks_and_pictures_have_the_frames_that_they_name(pair: DemoPair) -> None:
    found = mocban.align(pair.mesh, pair.print)
    image = mocban.read_print(pair.print).image
    relief = found.results["relief"]
    strokes = relief.aligned_mask()
    assert strokes.dtype == bool and strokes.shape == image.shape[:2] == found.print_mask().shape
    ink = found.print_mask()
    assert (strokes & ink).sum() / (strokes | ink).sum() > 0.6
    depth = found.depth()
    assert relief.mask().shape == depth.shape and depth.dtype == np.float64
    assert np.nanmin(depth[relief.mask()]) == pytest.approx(relief.threshold_depth, abs=1e-3)
    assert set(np.unique(relief.stroke_map())) <= {0, 128, 255}
    overlay = found.overlay()
    assert overlay.dtype == np.uint8 and overlay.shape[2] == 3
    assert "data:image/png;base64," in found._repr_html_()


def test_points_are_projected_and_lifted(pair: DemoPair) -> None:
    found = mocban.align(pair.mesh, pair.print)
    rows, columns = np.nonzero(found.results["relief"].aligned_mask())
    pixels = np.column_stack((columns, rows)).astype(float)
    points = found.lift(pixels)
    known = ~np.isnan(points[:, 0])
    assert known.mean() > 0.9
    np.testing.assert_allclose(found.project(points[known])[:, :2], pixels[known], atol=1e-9)
    vertices = mocban.read_mesh(pair.mesh).vertices
    nearest = [np.linalg.norm(vertices - point, axis=1).min() for point in points[known][::500]]
    assert max(nearest) < 0.2, "lifted points lie on the scan"
    assert np.isnan(found.lift([[-1e4, 0.0], [np.nan, 0.0]])).all()
    for wrong in ([1.0, 2.0], np.zeros((4, 2))):
        with pytest.raises(ValueError, match=r"\(N, 3\)"):
            found.project(wrong)


def test_results_are_frozen_values(pair: DemoPair) -> None:
    found = mocban.align(pair.mesh, pair.print)
    again = mocban.align(pair.mesh, pair.print)
    other = mocban.align(pair.mesh, pair.print, settings=mocban.settings(depth__longest_px=256))
    assert found == again and hash(found) == hash(again) and found != other
    copied = pickle.loads(pickle.dumps(found))
    assert copied == found and hash(copied) == hash(found) and repr(copied) == repr(found)
    assert copied.results["density"].aligned_mask().sum() == found.results["density"].aligned_mask().sum()
    results = pickle.loads(pickle.dumps(found.results))
    assert results == found.results and list(results) == list(found.results)
    assert (results["relief"].mask() == found.results["relief"].mask()).all()
    assert found.results["relief"] != other.results["relief"] and found.results != other.results
    for name in ("nl_ssim", "iou_box"):
        changed = copy.copy(found.results["relief"])
        object.__setattr__(changed, name, 0.125)
        assert changed != found.results["relief"], name
    result = pickle.loads(pickle.dumps(found.results["relief"]))
    assert result == found.results["relief"] and (result.mask() == found.results["relief"].mask()).all()
    with pytest.raises(AttributeError):
        found.status = "refused"  # type: ignore[misc]
    with pytest.raises(TypeError):
        found.results["relief"] = None  # type: ignore[index]
    with pytest.raises(ValueError):
        found.print_from_mesh[0, 0] = 1.0
    assert repr(found).startswith("<mocban.Alignment confidence ")


def test_chosen_metrics_alone_are_kept(pair: DemoPair) -> None:
    found = mocban.align(pair.mesh, pair.print, metrics=["Density"])
    assert list(found.results) == ["density"]
    assert found.results["DENSITY"] is found.results["density"] and "relief" not in found.results
    assert np.array_equal(found.overlay("Density"), found.overlay("density"))
    assert pickle.loads(pickle.dumps(found)) == found
    with pytest.raises(mocban.Error, match="no metric 'Releif'.*; did you mean 'relief'"):
        mocban.align(pair.mesh, pair.print, metrics=["Releif"])
    for wrong in (lambda: found.overlay("nope"), lambda: found.overlay("")):
        with pytest.raises(mocban.InputError, match="no result of the metric .*only of .*density") as error:
            wrong()
        assert error.value.code == "usage"
    paper = mocban.align(pair.mesh, pair.print, settings=mocban.settings("paper"))
    assert list(paper.results) == ["nl_ssim", "density", "ensemble"] and paper.confidence is None
    assert "not known" in repr(paper)
    assert np.array_equal(paper.overlay(), paper.overlay("ensemble"))


def test_a_refusal_is_a_result_unless_strict(pair: DemoPair, tmp_path: Path) -> None:
    blank = np.full((200, 200), 255, dtype=np.uint8)
    found = mocban.align(pair.mesh, blank)
    assert found.status == "refused" and found.results == {} and found.confidence is None
    assert found.refusal.code == "bad_input" and found.refusal.message.startswith("the print: ")
    assert pickle.loads(pickle.dumps(found)) == found and hash(found) == hash(mocban.align(pair.mesh, blank))
    assert pickle.loads(pickle.dumps(found.results)) == {}
    assert "refused" in repr(found) and "refused" in found._repr_html_()
    with pytest.raises(mocban.Refused) as error:
        mocban.align(pair.mesh, blank, strict=True)
    assert (error.value.code, error.value.hint) == (found.refusal.code, found.refusal.message)
    with pytest.raises(mocban.Refused):
        found.project([[0.0, 0.0, 0.0]])
    plane = mocban.Mesh.from_heights(np.zeros((50, 50)), mm_per_px=0.2)
    flat = mocban.align(plane, pair.print)
    assert flat.status == "refused" and flat.refusal.path is None


def test_a_depth_map_is_aligned(pair: DemoPair) -> None:
    found = mocban.align(pair.mesh, pair.print)
    mesh = mocban.read_mesh(pair.mesh)
    # The depth map reads like the print, so it is mirrored to become that of the block.
    heights = found.depth()[:, ::-1]
    mm_per_px = np.ptp(mesh.vertices, axis=0).max() / max(heights.shape)
    again = mocban.align(mocban.Mesh.from_heights(heights, mm_per_px=mm_per_px), pair.print)
    assert again.status == "aligned" and again.side == "+z"
    assert abs(again.rotation_deg - found.rotation_deg) < 1.0


def computed_s(process: int) -> float:
    """Return the time for which all threads of a process have computed, in seconds."""
    fields = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace").rpartition(") ")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the time is read from /proc")
def test_ctrl_c_stops_within_a_fifth_of_a_second(pair: DemoPair, tmp_path: Path) -> None:
    """Time of computing is measured, because other processes may take any time between."""
    script = tmp_path / "long.py"
    script.write_text(
        "import mocban, sys, time\n"
        "settings = mocban.settings(depth__longest_px=8192)\n"
        "try:\n"
        "    print('start', flush=True)\n"
        "    while True: mocban.align(sys.argv[1], sys.argv[2], settings=settings)\n"
        "except KeyboardInterrupt:\n"
        "    print(time.process_time(), flush=True)\n",
        encoding="utf-8",
    )
    delays = []
    for wait in (0.3, 0.7):
        process = subprocess.Popen(
            [sys.executable, script, pair.mesh, pair.print], stdout=subprocess.PIPE, text=True
        )
        assert process.stdout.readline() == "start\n"
        time.sleep(wait)
        sent = computed_s(process.pid)
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=600)
        delays.append(float(output) - sent)
    # Of each processor.
    assert max(delays) < 0.2 * (os.cpu_count() or 1) + 0.1, delays


def test_threads_compute_at_the_same_time(pair: DemoPair) -> None:
    ticks = 0
    done = threading.Event()

    def count() -> None:
        nonlocal ticks
        while not done.wait(0.001):
            ticks += 1

    counter = threading.Thread(target=count)
    counter.start()
    mocban.align(pair.mesh, pair.print)
    done.set()
    counter.join()
    assert ticks > 10, "the GIL is released"
