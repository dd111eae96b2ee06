"""A project whose catalog is in PostgreSQL. Skipped where no server is installed, or this user may not start one."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import mocban
import pytest

from conftest import DemoPair


@pytest.fixture()
def address() -> Iterator[str]:
    """The address of a server on a socket, whose data is removed afterwards."""
    versions = sorted(Path("/usr/lib/postgresql").glob("*/bin")) if os.name == "posix" else []
    if not versions:
        pytest.skip("no PostgreSQL server is installed")
    as_user: list[str] = []
    folder = Path(subprocess.check_output(["mktemp", "-d", "/tmp/mocban-pg-XXXXXX"], text=True).strip())
    if os.geteuid() == 0:
        as_user = ["setpriv", "--reuid=postgres", "--regid=postgres", "--clear-groups"]
        shutil.chown(folder, "postgres", "postgres")
    data, programs = folder / "data", versions[-1]

    def call(*command: object) -> None:
        done = subprocess.run([*as_user, *map(str, command)], capture_output=True, text=True, timeout=600, cwd="/tmp")
        assert done.returncode == 0, (command, done.stdout, done.stderr)

    try:
        call(programs / "initdb", "-D", data, "-U", "mocban", "-A", "trust", "--no-sync", "--locale=C", "-E", "UTF8")
        options = f"-c listen_addresses='' -c unix_socket_directories='{folder}' -c fsync=off"
        call(programs / "pg_ctl", "-D", data, "-w", "-t", 600, "-l", folder / "log", "-o", options, "start")
        try:
            yield f"postgresql://mocban@localhost/postgres?host={folder}"
        finally:
            call(programs / "pg_ctl", "-D", data, "-t", 600, "-m", "immediate", "stop")
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def test_a_project_on_a_server(address: str, pairs: list[DemoPair], tmp_path: Path) -> None:
    folder = tmp_path / "project"
    folder.mkdir()
    with pytest.raises(mocban.NotAProject, match="there is no catalog"):
        mocban.open(address, folder=folder)
    project = mocban.Project.create(folder, address)
    rows = [{"id": pair.id, "mesh": pair.mesh, "print": pair.print, "unit": pair.unit} for pair in pairs[:2]]
    assert project.import_pairs(rows)["added"] == 2
    assert project.run()["done"] == 2
    again = mocban.open(address, readonly=False, folder=folder)
    assert again.status()["jobs"]["done"] == 2 and "postgresql://" in repr(again)
    pair = again.pair(pairs[0].id)
    assert pair.alignment.status == "aligned"
    judged = pair.metrics["relief"]["result_hash"]
    assert again.add_verdict(pair.id, "relief", "pass", reviewer="Lan", expect=judged)
    assert [verdict["reviewer"] for verdict in again.verdicts()] == ["Lan"]
    with pytest.raises(mocban.ProjectError, match="password"):
        mocban.open("postgresql://mocban:secret@localhost/postgres", folder=folder)
