"""Ctrl-C and panics. The native module stops at a failpoint, which only a build with debug assertions has."""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
from pathlib import Path

import mocban
import pytest
from mocban import _native

from conftest import DemoPair

pytestmark = pytest.mark.skipif(
    not _native.HAS_FAILPOINTS or not hasattr(os, "mkfifo"), reason="the native module has no failpoints"
)

CHILD = """
import json, mocban, os, signal, sys

def noticed(*_):
    # The thread at the failpoint goes on when the file is gone.
    os.unlink(os.environ["MOCBAN_HOLD_FILE"])
    raise KeyboardInterrupt

signal.signal(signal.SIGINT, noticed)
project = mocban.Project.create(sys.argv[1])
try:
    CALL
    print("ended")
except KeyboardInterrupt:
    print("interrupted")
"""


def interrupt(tmp_path: Path, place: str, call: str, *arguments: object) -> str:
    """Run a call on a project in another process, send it SIGINT at a failpoint, and return what it prints."""
    held = tmp_path / "held"
    os.mkfifo(held)
    environment = os.environ | {"MOCBAN_HOLD_AT": place, "MOCBAN_HOLD_FILE": str(held)}
    environment["PYTHONPATH"] = os.pathsep.join(sys.path)
    command = [sys.executable, "-c", CHILD.replace("CALL", call), *map(str, arguments)]
    reader = os.open(held, os.O_RDONLY | os.O_NONBLOCK)
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stdout is not None
        events = select.poll()
        for file in (reader, process.stdout.fileno()):
            events.register(file, select.POLLIN | select.POLLHUP)
        # The failpoint opens and closes the file.
        assert [file for file, _ in events.poll(600_000)] == [reader], process.stdout.read()
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=600)
    os.close(reader)
    return output


def test_ctrl_c_drops_an_export(demo: Path, tmp_path: Path) -> None:
    earlier = mocban.open(demo).export(tmp_path / "earlier", ["csv"])
    for name in ("new", "earlier"):
        folder = tmp_path / name
        files = sorted(folder.rglob("*"))
        call = "project.export(sys.argv[2], ['jsonl'])"
        assert interrupt(tmp_path, "export:written", call, demo, folder) == "interrupted\n"
        assert sorted(folder.rglob("*")) == files, "an earlier export is kept"
    assert [path.name for path in tmp_path.iterdir()] == ["earlier"], "nothing is left of the export"
    assert mocban.open(demo).export(tmp_path / "new", ["csv"]) == earlier


def test_ctrl_c_drops_an_import(pairs: list[DemoPair], tmp_path: Path) -> None:
    rows = [{"id": pair.id, "mesh": str(pair.mesh), "print": str(pair.print)} for pair in pairs]
    call = "project.import_pairs(json.loads(sys.argv[2]))"
    folder = tmp_path / "new" / "project"
    assert interrupt(tmp_path, "import:computed", call, folder, json.dumps(rows)) == "interrupted\n"
    assert list(tmp_path.iterdir()) == [], "neither the project nor its folder was made"
    project = mocban.Project.create(folder)
    assert project.import_pairs(rows[:2])["added"] == 2
    assert interrupt(tmp_path, "import:computed", call, folder, json.dumps(rows)) == "interrupted\n"
    assert project.status()["pairs"] == 2 and project.import_pairs(rows)["added"] == len(rows) - 2


def test_a_panic_is_an_exception_and_a_log_message_but_prints_nothing(pair: DemoPair) -> None:
    script = (
        "import logging, mocban, sys\n"
        "logged = []\n"
        "class Kept(logging.Handler):\n"
        "    def emit(self, record): logged.append(record)\n"
        "logging.getLogger('mocban').addHandler(Kept())\n"
        "logging.getLogger('mocban').propagate = False\n"
        "try: mocban.align(sys.argv[1], sys.argv[2])\n"
        "except mocban.Error as error: print(error.code, '|', error.hint)\n"
        "for record in logged: print(record.levelname, '|', record.getMessage())\n"
    )
    environment = os.environ | {"MOCBAN_PANIC_AT": "align:computed", "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", script, pair.mesh, pair.print]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600)
    assert done.stderr == ""
    said, logged = done.stdout.splitlines()
    assert said.startswith("bug | the computation panicked, which is a defect of mocban; please report it: ")
    message = said.rpartition("please report it: ")[2]
    assert message and logged.startswith("ERROR | ") and "panicked at" in logged and logged.endswith(message)
