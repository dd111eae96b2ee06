"""Projects: status, results, verdicts, runs, reports and exports."""

from __future__ import annotations

import json
import logging
import math
import os
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from . import _native as _rust
from ._alignment import METRICS, Alignment, plain_metric, unknown_metric
from ._blocks import BlockAlignment
from ._errors import Cancelled, InputError, ReadOnlyProject
from ._frozen import Frozen
from ._inputs import Print, read_print

if TYPE_CHECKING:
    import numpy as np
    import pyarrow as _pyarrow
    from numpy.typing import NDArray

_LOG = logging.getLogger("mocban")


class Pair(Frozen):
    """A pair of a project, as it was when it was read. Made by `Project.pair`.

    Attributes
    ----------
    id : str
    status : str
        ``"done"``, or the state of its job.
    character, block : str or None
    meta : dict
        Other columns of the list.
    metrics : dict of str to dict
        Numbers and ``result_hash`` by metric; empty if the pair is not done.
    error : str or None
        Why the pair failed.
    """

    __slots__ = ("id", "status", "character", "block", "meta", "metrics", "error", "_detail", "_project", "_found")
    id: str
    status: str
    character: str | None
    block: str | None
    meta: dict[str, Any]
    metrics: dict[str, dict[str, Any]]
    error: str | None
    _detail: dict[str, Any]
    _project: Project
    _found: list[Alignment]

    def __init__(self, project: Project, detail: dict[str, Any]) -> None:
        failure = detail.get("failure")
        self._set(
            id=detail["name"],
            status=detail["status"],
            character=detail.get("character"),
            block=detail.get("block"),
            meta=detail.get("meta", {}),
            metrics={record["metric"]: record for record in detail["metrics"]},
            error=None if failure is None else failure.get("message"),
            _detail=detail,
            _project=project,
            _found=[],
        )

    @property
    def alignment(self) -> Alignment:
        """The stored alignment, equal to that of `align` for the same files, unit and side.

        Raises
        ------
        ProjectError
            If the pair is not done, or its files are missing or have changed.
        """
        if not self._found:
            self._found.append(Alignment(self._project._native.alignment(self.id)))
        return self._found[0]

    def print(self) -> Print:
        """Return the image of the print."""
        return read_print(self.files["print"])

    def depth(self) -> NDArray[np.float64]:
        """Return the depth map: heights over the fitted surface; NaN without data."""
        return self.alignment.depth()

    def mask(self, metric: str | None = None) -> NDArray[np.bool_]:
        """Return the strokes of a metric in the frame of the print; of the one that is shown first by default."""
        results = self.alignment.results
        metric = self.alignment._first if metric is None else metric
        if metric is None or metric not in results:
            raise unknown_metric(metric, results)
        return results[metric].aligned_mask()

    def overlay(self, metric: str | None = None) -> NDArray[np.uint8]:
        """Return the print with the edges of the strokes of a metric; of the one that is shown first by default."""
        return self.alignment.overlay(metric)

    def history(self) -> list[dict[str, Any]]:
        """Return the attempts at its stages, oldest first."""
        return list(self._detail["attempts"])

    @property
    def files(self) -> dict[str, Path]:
        """Paths by name: ``"mesh"`` and ``"print"``."""
        folder = self._project.folder
        return {"mesh": folder / self._detail["mesh_path"], "print": folder / self._detail["print_path"]}

    def __reduce__(self) -> tuple[Any, ...]:
        return Pair, (self._project, self._detail)

    def __repr__(self) -> str:
        return f"<mocban.Pair {self.id}: {self.status}>"


class Project:
    """A project. Made by `open`.

    Nothing stays open between calls, so that a project can be read during a run, and a `Project` can be pickled.
    """

    def __init__(self, folder: str | os.PathLike[str], catalog: str | None, readonly: bool) -> None:
        self._folder, self._catalog, self._readonly = Path(folder), catalog, readonly
        self._native = _rust.NativeProject(os.fspath(folder), catalog)
        # A folder that is removed with this object.
        self._temporary: tempfile.TemporaryDirectory[str] | None = None

    @classmethod
    def create(cls, folder: str | os.PathLike[str], catalog: str | None = None) -> Project:
        """Return a project that need not exist: the first `import_pairs` makes it, as ``mocban import`` does.

        Parameters
        ----------
        folder : path-like
        catalog : str, optional
            Address of a catalog in PostgreSQL; a file in the folder by default.

        Examples
        --------
        >>> import mocban
        >>> project = mocban.Project.create("new")
        >>> project.import_pairs([{"id": "one", "mesh": "pair.stl", "print": "pair.png"}])["added"]
        1
        """
        return cls(folder, catalog, False)

    @property
    def folder(self) -> Path:
        """The project's folder."""
        return self._folder

    @property
    def readonly(self) -> bool:
        """Whether methods that write are refused."""
        return self._readonly

    def __enter__(self) -> Project:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        return None

    def _key(self) -> tuple[Path, str | None, bool]:
        return (self._folder, self._catalog, self._readonly)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Project) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def __reduce__(self) -> tuple[Any, ...]:
        if self._temporary is not None:
            raise TypeError("the project is in a temporary folder; give align_block a folder to pickle what it returns")
        return Project, self._key()

    def __repr__(self) -> str:
        return f"<mocban.Project {self._catalog or self._folder}{', read-only' if self._readonly else ''}>"

    def _writable(self) -> _rust.NativeProject:
        if self._readonly:
            text = f"{self._folder} was opened for reading; open it with readonly=False"
            raise ReadOnlyProject(text, "read_only", self._folder)
        return self._native

    def status(self) -> dict[str, Any]:
        """Return the counts of ``mocban status --json``, with the failed pairs."""
        return json.loads(self._native.status())

    @property
    def settings(self) -> dict[str, Any]:
        """Settings in effect, by section."""
        return json.loads(self._native.settings())

    def pairs(
        self,
        columns: Sequence[str] | None = None,
        *,
        metric: str | None = "relief",
        where: Any = None,
    ) -> _pyarrow.Table:
        """Return a table with a row for each pair, or for each pair and metric. Needs pyarrow.

        Parameters
        ----------
        columns : sequence of str, optional
            Columns to return: those of ``mocban export --to parquet``.
        metric : str or None
            The metric of the rows; None for all.
        where : pyarrow.compute.Expression, optional
            Rows to return.

        Returns
        -------
        pyarrow.Table
            For polars.from_arrow, pandas (``to_pandas()``) and duckdb.
        """
        try:
            import pyarrow.compute
            import pyarrow.parquet
        except ImportError:
            raise ImportError("Project.pairs needs pyarrow: pip install 'mocban[arrow]'") from None
        metric = None if metric is None else plain_metric(metric)
        if metric is not None and metric not in METRICS:
            raise unknown_metric(metric, METRICS)
        if where is not None and not isinstance(where, pyarrow.compute.Expression):
            text = "where is no expression of pyarrow; give one such as pyarrow.compute.field('iou') > 0.9"
            raise InputError(text, "usage")
        metrics: list[str] = list(METRICS) if metric is None else [metric]
        if self.settings["pipeline"]["method"] == "paper":
            metrics = [name for name in metrics if name != "relief"] or ["ensemble"]
        with tempfile.TemporaryDirectory(prefix="mocban-") as folder:
            table = Path(folder) / "table"
            self._native.export(os.fspath(table), ["parquet"], metrics, "all", False)
            file = table / "pairs.parquet"
            known = pyarrow.parquet.read_schema(file).names
            for name in columns or ():
                if name not in known:
                    raise InputError(f"there is no column {name!r}, only {', '.join(known)}", "usage")
            read = pyarrow.parquet.read_table(file, columns=columns, filters=where, memory_map=False)
        return read.replace_schema_metadata(None)

    def pair(self, id: str) -> Pair:
        """Return a pair by its id.

        Raises
        ------
        ProjectError
            If there is no such pair.
        """
        return Pair(self, json.loads(self._native.pair(id)))

    def block(self, id: str) -> BlockAlignment:
        """Return a block by its id.

        Raises
        ------
        ProjectError
            If there is no such block.
        """
        return BlockAlignment(self._block(id), self)

    def _block(self, id: str) -> dict[str, Any]:
        return json.loads(self._native.block(id))

    def verdicts(self) -> list[dict[str, Any]]:
        """Return the log of verdicts, oldest first."""
        return json.loads(self._native.verdicts())

    def add_verdict(
        self,
        id: str,
        metric: str | None,
        verdict: str,
        *,
        reason: str | None = None,
        note: str | None = None,
        reviewer: str,
        expect: str | None = None,
        new_reviewer: bool = False,
        adjudicate: bool = False,
    ) -> bool:
        """Record a verdict on the current result of a pair, under the rules of ``mocban verdict set``.

        Parameters
        ----------
        id : str
        metric : str or None
            None for the results of all metrics.
        verdict : {"pass", "fail", "unsure"}
        reason : str, optional
            Of a failure, such as ``"angle"``.
        note : str, optional
        reviewer : str
        expect : str, optional
            ``result_hash`` of the result that was looked at.
        new_reviewer : bool
            Whether a new reviewer's name may differ from that of another only in case or accents.
        adjudicate : bool
            Whether the verdict settles a conflict: it is recorded only for results on which two others disagree.

        Returns
        -------
        bool
            Whether it is new; false if the same verdict was recorded before.

        Raises
        ------
        StaleResult
            If the current result is not ``expect``. Nothing is recorded.
        ProjectError
            If there is no such pair, or with ``adjudicate``, no conflict that the reviewer may settle.
        InputError
            If an argument is none of these words, or cannot be recorded.
        ReadOnlyProject
            If the project was opened for reading.
        """
        return self._writable().add_verdict(
            id, metric, verdict, reviewer, reason, note, expect, new_reviewer, adjudicate
        )

    def import_pairs(
        self,
        rows: Any,
        *,
        allow_missing: bool = False,
        allow_changed_files: bool = False,
        replace: bool = False,
    ) -> dict[str, Any]:
        """Import pairs, as ``mocban import`` does. If a row is refused, nothing is imported.

        Parameters
        ----------
        rows : iterable of mappings, or a data frame of pandas, polars or pyarrow
            With the columns ``id``, ``mesh`` and ``print``; optional ``character``, ``block``, ``unit`` and
            ``scanned_face_down``; others are kept, as text if JSON has no such type. Paths are relative to the working
            directory. None, NaN, NA and NaT are left out. Messages call the first row line 1.
        allow_missing : bool
            Whether files may be missing.
        allow_changed_files : bool
            Whether most of the pairs that the project has may get another mesh and another print.
        replace : bool
            Whether pairs that ``rows`` does not have are retired: they are in no count, and their results and verdicts
            are kept.

        Returns
        -------
        dict
            Numbers ``added``, ``unchanged``, ``retired``, ``restored`` and ``still_retired`` (listed pairs that a person
            retired), ids ``changed``, and ``missing_files``.
        """
        records = enumerate(_records(rows), 1)
        lines = "".join(json.dumps(_row(row, line), ensure_ascii=False, default=str) + "\n" for line, row in records)
        file = Path.cwd() / "rows"
        project = self._writable()
        rows_json = lines.encode()
        outcome = json.loads(
            project.import_pairs(os.fspath(file), rows_json, allow_missing, allow_changed_files, replace)
        )
        return _without_warnings(outcome)

    def import_block(
        self,
        mesh: str | os.PathLike[str],
        page: str | os.PathLike[str],
        *,
        labels: str | os.PathLike[str] | None = None,
        id: str | None = None,
        unit: str | None = None,
        side: str | None = None,
    ) -> dict[str, Any]:
        """Import a whole block with its page, as ``mocban import --block`` does.

        Parameters
        ----------
        mesh, page : path-like
            The scan of the block, and the image of its page.
        labels : path-like, optional
            Boxes of the characters; found by `run` by default.
        id : str, optional
            The file name of the mesh without extension by default.
        unit : {"mm", "cm", "m", "in"}, optional
        side : {"front", "back"}, optional
            The side of the block that the page shows; found by `run` by default.

        Returns
        -------
        dict
            Numbers ``added`` and ``unchanged``, and ids ``changed``.

        Raises
        ------
        InputNotFound
            If a file is not there. Nothing is imported.
        """
        boxes = None if labels is None else os.fspath(labels)
        files = (os.fspath(mesh), os.fspath(page), boxes)
        return _without_warnings(json.loads(self._writable().import_block(*files, id, unit, side)))

    def run(
        self,
        *,
        ids: Iterable[str] | None = None,
        workers: int | None = None,
        progress: Callable[[dict[str, Any]], object] | None = None,
        stop_at_once: bool = False,
    ) -> dict[str, Any]:
        """Run pairs until none is left, as ``mocban run`` does.

        Ctrl-C finishes the stages in progress, stores them and raises KeyboardInterrupt; a second one, or the first with
        ``stop_at_once``, stops at once. What was stored before stays.

        Parameters
        ----------
        ids : iterable of str, optional
            Pairs and blocks to run; all by default.
        workers : int, optional
            Pairs computed at the same time; that of the settings by default.
        progress : callable, optional
            Called with each event, a dict with ``message_type`` such as ``"started"`` or ``"pair_done"``. If it returns
            False, the run is stopped; an exception stops it too, and is raised.
        stop_at_once : bool
            Whether a stop loses the stages in progress, which take seconds if they are of a block.

        Returns
        -------
        dict
            Numbers of pairs ``done``, ``failed`` and ``left``, and more.

        Raises
        ------
        ProjectBusy
            If another process runs the project.
        Cancelled
            If ``progress`` returned False.
        """
        if workers is not None and workers < 1:
            raise InputError(f"workers is {workers}; give a number of at least 1", "usage")
        names = [] if ids is None else [ids] if isinstance(ids, str) else list(ids)
        if ids is not None and not names:
            raise InputError("ids is empty; leave it out to run all pairs", "nothing_selected")

        def heard(event: str) -> None:
            assert progress is not None
            if progress(json.loads(event)) is False:
                text = "the run was stopped by its progress function; what was computed so far is stored"
                raise Cancelled(text, "cancelled", self._folder)

        return json.loads(self._writable().run(names, workers, None if progress is None else heard, stop_at_once))

    def report(self) -> dict[str, Any]:
        """Return the report of ``mocban report --format json``."""
        return json.loads(self._native.report("json"))

    def export(
        self,
        dir: str | os.PathLike[str],
        formats: str | Sequence[str] = "jsonl",
        *,
        metrics: Sequence[str] | None = None,
        only: str = "all",
    ) -> dict[str, Any]:
        """Export the results for other tools, as ``mocban export`` does.

        Parameters
        ----------
        dir : path-like
            An earlier export there is replaced as a whole, unless somebody changed it. Several formats get a folder each.
        formats : str or sequence of str
            Such as ``"jsonl"``, ``"csv"``, ``"parquet"`` or ``"huggingface"``.
        metrics : sequence of str, optional
        only : {"all", "confident", "passed"}

        Returns
        -------
        dict
            Numbers of pairs, and those that cannot be read.
        """
        chosen = [formats] if isinstance(formats, str) else list(formats)
        if not chosen:
            raise InputError("formats is empty; give one such as 'csv'", "usage")
        return json.loads(self._native.export(os.fspath(dir), chosen, list(metrics or ()), only, False))


def _without_warnings(outcome: dict[str, Any]) -> dict[str, Any]:
    """Log the warnings of an import, and return the rest of its outcome."""
    for warning in outcome.pop("warnings"):
        _LOG.warning("%s", warning)
    return outcome


def _records(rows: Any) -> Iterable[Mapping[str, Any]]:
    if isinstance(rows, (str, bytes, os.PathLike, Mapping)):
        text = f"the rows are a {type(rows).__name__}; give a list of dicts or a data frame"
        raise InputError(text, "usage")
    for method in ("to_dicts", "to_pylist"):  # polars, pyarrow
        if hasattr(rows, method):
            return getattr(rows, method)()
    if hasattr(rows, "to_dict") and hasattr(rows, "columns"):  # pandas
        return rows.to_dict("records")
    return rows


def _row(row: Any, line: int) -> dict[str, Any]:
    if not isinstance(row, Mapping):
        text = f"line {line} of the rows is a {type(row).__name__}; give a dict with id, mesh and print"
        raise InputError(text, "usage")
    values: dict[str, Any] = {}
    for name, value in row.items():
        if hasattr(value, "item"):
            value = value.item()
        if isinstance(value, os.PathLike):
            value = os.fspath(value)
        if _is_missing(value):
            continue
        values[str(name)] = str(value) if name == "id" else value
    return values


def _is_missing(value: Any) -> bool:
    """Return whether a value is None, NaN, or pandas' NA or NaT, which cannot all be compared."""
    if isinstance(value, float):
        return math.isnan(value)
    return value is None or type(value).__name__ in ("NAType", "NaTType")


def open(
    path_or_url: str | os.PathLike[str],
    *,
    readonly: bool = True,
    folder: str | os.PathLike[str] | None = None,
) -> Project:
    """Open a project.

    Parameters
    ----------
    path_or_url : path-like
        The project's folder, or the address of a catalog in PostgreSQL without a password (``postgresql://...``).
    readonly : bool
        Whether methods that write are refused.
    folder : path-like
        The project's folder, if an address is given; the working directory by default.

    Returns
    -------
    Project

    Raises
    ------
    NotAProject
        If there is no project.
    ProjectVersionError
        If another version of mocban wrote it. It is never changed to this version.

    Examples
    --------
    >>> import mocban
    >>> with mocban.open("demo") as project:
    ...     project.status()["pairs"]
    4
    """
    text = os.fspath(path_or_url)
    is_url = text.startswith(("postgres://", "postgresql://"))
    if "://" in text and not is_url:
        raise InputError(f"{text} is no address of a catalog; give postgresql://...", "usage")
    if folder is not None and not is_url:
        raise InputError("folder is only for an address; give the folder of the project alone", "usage")
    project = Project(folder or ".", text, readonly) if is_url else Project(text, None, readonly)
    project._native.check(readonly)
    return project
