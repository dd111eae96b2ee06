"""Many pairs: threads, processes, memory."""

from __future__ import annotations

import concurrent.futures
import multiprocessing
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import mocban
import numpy as np
import pytest
from mocban import _many, _native

from conftest import DemoPair


def test_results_come_in_order_and_failures_end_nothing(pairs: list[DemoPair], tmp_path: Path) -> None:
    todo = [(pair.id, pair.mesh, pair.print) for pair in pairs[:6]]
    todo.insert(2, ("missing", tmp_path / "no.stl", pairs[0].print))
    found = list(mocban.align_many(todo, threads=2))
    assert [key for key, _ in found] == [key for key, _, _ in todo]
    assert isinstance(found[2][1], mocban.InputNotFound)
    one = list(mocban.align_many(iter(todo), threads=1, max_bytes=1))
    assert [result for key, result in one if key != "missing"] == [r for key, r in found if key != "missing"]
    assert found[0][1] == mocban.align(pairs[0].mesh, pairs[0].print)


def test_an_exception_of_the_pairs_comes_after_the_results_before_it(pair: DemoPair) -> None:
    def failing():
        yield "a", pair.mesh, pair.print
        yield "b", pair.mesh, pair.print
        raise LookupError("no more")

    found = mocban.align_many(failing(), threads=2)
    assert [next(found)[0], next(found)[0]] == ["a", "b"]
    with pytest.raises(LookupError):
        next(found)
    with pytest.raises(mocban.InputError, match="give .key, mesh, print."):
        list(mocban.align_many([(pair.mesh, pair.print)]))  # type: ignore[list-item]
    for wrong in ({"threads": 1.5}, {"max_bytes": 0}, {"metrics": ["nope"]}, {"metrics": []}, {"settings": {}}):
        with pytest.raises(mocban.Error):
            mocban.align_many([], **wrong)  # type: ignore[arg-type]


def test_pairs_are_taken_when_they_are_needed(pair: DemoPair) -> None:
    taken = 0

    def endless():
        nonlocal taken
        while True:
            taken += 1
            yield taken, pair.mesh, pair.print

    results = mocban.align_many(endless(), threads=2, metrics="density")
    assert taken == 0, "nothing begins before the first result is asked for"
    assert next(results)[0] == 1 and taken <= 4
    assert list(next(results)[1].results) == ["density"]
    results.close()
    for thread in threading.enumerate():
        if thread.name == "mocban align_many":
            thread.join(600)
    assert not any(thread.name == "mocban align_many" for thread in threading.enumerate())


def test_other_exceptions_end_the_iteration(pair: DemoPair) -> None:
    def broken():
        yield 1, pair.mesh, pair.print
        raise KeyError("rows")

    with pytest.raises(KeyError):
        list(mocban.align_many(broken(), threads=1))
    with pytest.raises(ValueError, match="threads is 0"):
        mocban.align_many([], threads=0)
    assert list(mocban.align_many([])) == []


class NoticedPath(os.PathLike):
    """A path that tells when it is read, which `align_many` does on its threads."""

    def __init__(self, path: Path, read: threading.Event) -> None:
        self.path, self.read = path, read

    def __fspath__(self) -> str:
        self.read.set()
        return str(self.path)


def test_closing_stops_the_pairs_in_process(pair: DemoPair, tmp_path: Path) -> None:
    # A pair takes many seconds with this setting.
    large = mocban.settings(depth__longest_px=8192)
    begun = threading.Event()
    todo = [("missing", tmp_path / "no.stl", pair.print)]
    todo += [(number, NoticedPath(pair.mesh, begun), pair.print) for number in range(3)]
    results = mocban.align_many(todo, threads=2, settings=large)
    assert next(results)[0] == "missing" and begun.wait(600)
    # The time for which all threads compute, because other processes may take any time between.
    closed = time.process_time()
    results.close()
    for thread in threading.enumerate():
        if thread.name == "mocban align_many":
            thread.join(600)
    assert time.process_time() - closed < 2.0


def test_memory_is_estimated_from_pixels_and_not_from_the_size_of_a_file(pair: DemoPair, tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    white, chosen = np.full((2000, 4000, 3), 255, dtype=np.uint8), mocban.settings()
    file = tmp_path / "white.jpg"
    image.fromarray(white).save(file)
    assert file.stat().st_size < 1_000_000
    pictures = (file, str(file), mocban.Print(white), white, image.fromarray(white))
    estimates = [_many._estimate(pair.mesh, picture, chosen) for picture in pictures]
    assert all(240e6 < estimate < 340e6 for estimate in estimates), estimates
    mesh = mocban.read_mesh(pair.mesh)
    nothing = _many._estimate(object(), [], chosen)
    assert _many._estimate(mesh, [], chosen) - nothing > 24 * len(mesh.vertices)
    assert _many._estimate(object(), [[0, 255]] * 3, chosen) - nothing == 6 * 30
    large = mocban.settings(depth__longest_px=8192)
    assert _many._estimate(object(), [], large) - nothing > 8000**2 * 20


def test_results_that_wait_count_as_memory(pair: DemoPair) -> None:
    work = _many._Work("a", pair.mesh, pair.print)
    work.estimate = 7
    assert work.held_bytes() == 7
    work.run(None, mocban.settings(), _native.NativeCancel())
    width, height = mocban.read_print(pair.print).size
    assert 6 * width * height < work.held_bytes() < 50e6
    yielded = 0

    def counted():
        for number in range(4):
            assert number <= yielded + 1, "one pair is in memory, and one was looked at"
            yield number, pair.mesh, pair.print

    for key, _ in mocban.align_many(counted(), threads=2, max_bytes=1):
        assert key == yielded
        yielded += 1
    assert yielded == 4


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="the system has no affinity")
def test_threads_are_those_that_the_process_may_use() -> None:
    allowed = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(allowed)})
        assert _native.available_threads() == 1
    finally:
        os.sched_setaffinity(0, allowed)


def confidence(mesh: str, image: str) -> float:
    return mocban.align(mesh, image).confidence


def test_threads_and_spawned_processes_give_the_same_result(pair: DemoPair) -> None:
    arguments = (str(pair.mesh), str(pair.print))
    expected = mocban.align(*arguments)
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        assert all(found == expected for found in pool.map(mocban.align, *zip(*[arguments] * 4)))
    spawn = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=spawn) as pool:
        assert pool.submit(mocban.align, *arguments).result(600) == expected, "results are pickled"


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no fork")
def test_work_after_a_fork_is_refused_and_a_fork_before_any_work_is_not(pair: DemoPair) -> None:
    script = (
        "import mocban, os, sys, warnings\n"
        "warnings.simplefilter('ignore')\n"
        "if sys.argv[3] == 'used': mocban.align(sys.argv[1], sys.argv[2])\n"
        "child = os.fork()\n"
        "if child == 0:\n"
        "    try: print(mocban.align(sys.argv[1], sys.argv[2]).status, flush=True)\n"
        "    except mocban.Error as error: print(error.code, 'spawn' in error.hint, flush=True)\n"
        "    os._exit(0)\n"
        "os.waitpid(child, 0)\n"
    )
    for state, expected in (("used", "forked True"), ("fresh", "aligned")):
        command = [sys.executable, "-c", script, pair.mesh, pair.print, state]
        assert subprocess.check_output(command, text=True, timeout=600).strip() == expected


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no fork")
def test_attributes_of_a_print_wait_for_no_lock_after_a_fork() -> None:
    script = (
        "import mocban, numpy, os, signal, threading, warnings\n"
        "warnings.simplefilter('ignore')\n"
        "image = mocban.Print(numpy.full((5000, 5000, 3), 255, dtype=numpy.uint8))\n"
        "begun = threading.Event()\n"
        # The thread holds the lock of the image while it is converted.
        "def convert():\n"
        "    begun.set()\n"
        "    image.image16\n"
        "thread = threading.Thread(target=convert)\n"
        "thread.start()\n"
        "begun.wait()\n"
        "for _ in range(5):\n"
        "    child = os.fork()\n"
        "    if child == 0:\n"
        "        signal.alarm(120)\n"
        "        print(image.size, image.warnings, image.dpi, flush=True)\n"
        "        os._exit(0)\n"
        "    os.waitpid(child, 0)\n"
        "thread.join()\n"
    )
    output = subprocess.check_output([sys.executable, "-c", script], text=True, timeout=900)
    assert output == "(5000, 5000) () None\n" * 5


def test_memory_does_not_grow(pair: DemoPair) -> None:
    """The bar is 20 MB in 1,000 calls; MOCBAN_CALLS is their number."""
    resource = pytest.importorskip("resource")
    if not sys.platform.startswith("linux"):
        pytest.skip("the memory in use is read from /proc")
    page = resource.getpagesize()

    def in_use() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * page

    mesh, image = mocban.read_mesh(pair.mesh), mocban.read_print(pair.print).image
    arrays = (mesh.vertices, mesh.faces)
    calls = int(os.environ.get("MOCBAN_CALLS", "40"))
    for call in range(calls + 10):
        if call == 10:
            before = in_use()
        found = mocban.align(mocban.Mesh(*arrays), image)
        found.overlay()
        with pytest.raises(mocban.MeshError):
            mocban.Mesh(arrays[0][:, :2])
    assert in_use() - before < 20e6, f"{(in_use() - before) / 1e6:.1f} MB"
