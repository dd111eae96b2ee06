"""Whole blocks with their pages."""

from __future__ import annotations

import json
import os
import struct
import tempfile
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._alignment import Alignment
from ._errors import ImageError, InputError, ProjectError, Refused
from ._frozen import Frozen
from ._inputs import Mesh, Print, mesh_of
from ._settings import settings_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from ._project import Project


class BlockCharacter(Frozen):
    """A character of a block. Part of a `BlockAlignment`.

    Attributes
    ----------
    label : str
        Name of its box, such as ``"c01-r02"``: column and row.
    character : str or None
        The character, if the labels name it.
    box : tuple of float
        Edges of its box on the page in pixels: left, top, right, bottom. The centre of the pixel at the top left is
        (0, 0).
    confidence : float or None
        How sure its position is, from 0 to 1.
    state : str
        ``"cut"`` if it is a pair, otherwise what became of it.
    reason : str or None
        Why it was not cut.
    pair : str or None
        Id of its pair in the project.
    """

    __slots__ = ("label", "character", "box", "confidence", "state", "reason", "pair", "_stored", "_project", "_found")
    label: str
    character: str | None
    box: tuple[float, float, float, float]
    confidence: float | None
    state: str
    reason: str | None
    pair: str | None
    _stored: Mapping[str, Any]
    _project: Project
    _found: list[Alignment]

    def __init__(self, stored: Mapping[str, Any], project: Project) -> None:
        left, top, right, bottom = stored["box"]
        self._set(
            label=stored["label"],
            character=stored["character"],
            box=(left, top, right, bottom),
            confidence=stored["confidence"],
            state=stored["state"],
            reason=stored["reason"],
            pair=stored["pair"],
            _stored=stored,
            _project=project,
            _found=[],
        )

    @property
    def page_from_mesh(self) -> NDArray[np.float64] | None:
        """Map from points of the block's mesh to pixels of the page and heights, of shape (3, 4); None if not placed."""
        import numpy as np

        stored = (self._stored["maps"] or {}).get("page_from_mesh")
        return None if stored is None else np.array(stored)

    @property
    def alignment(self) -> Alignment:
        """The alignment of the character with its print, read when it is first asked for.

        Raises
        ------
        Refused
            If the character was not cut.
        ProjectError
            If its pair is not aligned.
        """
        if not self._found:
            if self.pair is None:
                text = f"character {self.label} was not cut: {self.reason or self.state}"
                raise Refused(text, "not_cut", self._project.folder)
            self._found.append(self._project.pair(self.pair).alignment)
        return self._found[0]

    def __reduce__(self) -> tuple[Any, ...]:
        return BlockCharacter, (self._stored, self._project)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, BlockCharacter) and self._stored == other._stored

    def __hash__(self) -> int:
        return hash((self.label, self.box))

    def __repr__(self) -> str:
        return f"<mocban.BlockCharacter {self.label}: {self.state}>"


class BlockAlignment(Frozen):
    """A block and its page, as they were when they were read. Made by `align_block` and `Project.block`.

    Attributes
    ----------
    id : str
    status : str
        ``"done"``, or the state of its job.
    error : str or None
        Why the block failed.
    meta : dict
        Other columns of the list.
    agreement : float or None
        Part of the page's windows in which carving and ink agree, from 0 to 1; None before the block is aligned.
    characters : tuple of BlockCharacter
        In reading order.
    project : Project
        The project that holds the block and its pairs.
    """

    __slots__ = ("id", "status", "error", "meta", "agreement", "characters", "project", "_stored")
    id: str
    status: str
    error: str | None
    meta: dict[str, Any]
    agreement: float | None
    characters: tuple[BlockCharacter, ...]
    project: Project
    _stored: Mapping[str, Any]

    def __init__(self, stored: Mapping[str, Any], project: Project) -> None:
        failure = stored["failure"]
        outcomes = {stage["stage"]: stage["outcome"] for stage in stored["stages"]}
        aligned = outcomes.get("align")
        self._set(
            id=stored["name"],
            status=stored["status"],
            error=None if failure is None else failure["message"],
            meta=stored["meta"],
            agreement=None if aligned is None else aligned["agreement"]["share"],
            characters=tuple(BlockCharacter(one, project) for one in stored["character_list"]),
            project=project,
            _stored=stored,
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return BlockAlignment, (self._stored, self.project)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, BlockAlignment) and self._stored == other._stored

    def __hash__(self) -> int:
        return hash((self.id, self.characters))

    def __repr__(self) -> str:
        return f"<mocban.BlockAlignment {self.id}: {self.status}, {len(self.characters)} characters>"


def align_block(
    mesh: Mesh | str | os.PathLike[str],
    page: Print | str | os.PathLike[str] | ArrayLike,
    *,
    labels: str | os.PathLike[str] | Iterable[Mapping[str, Any]] | None = None,
    unit: str | None = None,
    side: str | None = None,
    folder: str | os.PathLike[str] | None = None,
    workers: int | None = None,
    progress: Callable[[dict[str, Any]], object] | None = None,
    strict: bool = False,
) -> BlockAlignment:
    """Align a whole block with its page, cut its characters, and align each of them.

    The result is that of a project with this block. Ctrl-C stops the work; with ``folder``, another call goes on.

    Parameters
    ----------
    mesh : Mesh or path-like
        The scan of the block.
    page : Print, path-like or array_like
        The image of the printed page.
    labels : path-like or iterable of mappings, optional
        Boxes of the characters: a file that ``mocban import --labels`` reads, or mappings with ``box`` (edges in pixels:
        left, top, right, bottom, as in `BlockCharacter`) and optional ``label`` and ``character``. Found by default.
    unit : {"mm", "cm", "m", "in"}, optional
        Unit of a file; a `Mesh` has its own.
    side : {"front", "back"}, optional
        The side of the block that the page shows; found by default.
    folder : path-like, optional
        Folder of the project that is made for the block. By default a temporary one, which is removed with the last object
        that refers to its project.
    workers : int, optional
        Characters aligned at the same time.
    progress : callable, optional
        That of `Project.run`.
    strict : bool
        Whether a refusal of the block is an exception.

    Returns
    -------
    BlockAlignment
        With its ``error`` if the block is refused, unless ``strict``.

    Raises
    ------
    InputNotFound
        If a file is not there.
    ProjectError
        If ``folder`` holds anything but the project of an earlier call.
    Refused
        If the block is refused and ``strict`` is true.

    Examples
    --------
    >>> import mocban
    >>> block = mocban.align_block("block.ply", "page.jpg", labels="labels.json")
    >>> block.status, block.characters[0].alignment.status
    ('done', 'aligned')
    """
    from ._project import Project

    temporary = None
    if folder is None:
        temporary = tempfile.TemporaryDirectory(prefix="mocban-")
        folder = temporary.name
    place = Path(folder)
    if temporary is None:
        _require_own(place)
    made = place / "inputs"
    if not isinstance(mesh, (str, os.PathLike)):
        given = mesh_of(mesh, settings_of(None), unit)
        unit = given.unit
        mesh = _written(made / "block.ply", _ply(given))
    if not isinstance(page, (str, os.PathLike)):
        page = _written(made / "page.png", _png(page if isinstance(page, Print) else Print(page)))
    if labels is not None and not isinstance(labels, (str, os.PathLike)):
        labels = _written(made / "labels.json", json.dumps([_box(one) for one in labels], ensure_ascii=False).encode())
    project = Project.create(place)
    project._temporary = temporary
    project.import_block(mesh, page, labels=labels, id="block", unit=unit, side=side)
    project.run(workers=workers, progress=progress, stop_at_once=True)
    found = BlockAlignment(project._block("block"), project)
    if strict and found.error is not None:
        raise Refused(f"the block is not aligned: {found.error}", "no_solution", os.fspath(mesh))
    return found


def _require_own(folder: Path) -> None:
    """Refuse a folder that holds anything but the project of an earlier call."""
    from ._project import Project

    if not folder.exists() or (folder.is_dir() and not any(folder.iterdir())):
        return
    try:
        project = Project(folder, None, True)
        status = project.status()
        project._block("block")
    except (ProjectError, OSError):
        status = {}
    if status.get("blocks", {}).get("total") != 1:
        text = f"{folder} holds something else than a block of align_block; give a new folder"
        raise ProjectError(text, "usage", folder)


def _written(path: Path, content: bytes) -> Path:
    """Write a file, unless it has this content already, so that a second call finds the same file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_bytes() != content:
        path.write_bytes(content)
    return path


def _box(label: Mapping[str, Any]) -> dict[str, Any]:
    try:
        # Files count from the outer corner of the pixel at the top left.
        left, top, right, bottom = (float(edge) + 0.5 for edge in label["box"])
    except (KeyError, TypeError, ValueError) as reason:
        text = f"the label {label!r} has no box: give {{'box': (left, top, right, bottom)}}"
        raise InputError(text, "bad_input") from reason
    if not (left < right and top < bottom):
        text = f"the box of the label {label!r} is empty: give left < right and top < bottom"
        raise InputError(text, "bad_input")
    named = {name: str(label[key]) for name, key in (("id", "label"), ("character", "character")) if label.get(key)}
    return {"x_min": left, "y_min": top, "x_max": right, "y_max": bottom, **named}


def _ply(mesh: Mesh) -> bytes:
    """Return a mesh as a binary PLY file."""
    import numpy as np

    points, faces = mesh.vertices, mesh.faces
    single = points.astype("<f4")
    kind, stored = ("float", single) if np.array_equal(single, points) else ("double", points.astype("<f8"))
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    header += [f"property {kind} {axis}" for axis in "xyz"]
    body = stored.tobytes()
    if faces is not None:
        header += [f"element face {len(faces)}", "property list uchar uint vertex_indices"]
        rows = np.empty(len(faces), dtype=[("count", "u1"), ("corners", "<u4", 3)])
        rows["count"], rows["corners"] = 3, faces
        body += rows.tobytes()
    return "\n".join([*header, "end_header", ""]).encode() + body


def _png(page: Print) -> bytes:
    """Return an image as a PNG file of 16 bits with alpha, because 16 bits without may be read as those of a camera."""
    import numpy as np

    wide = page.image16
    height, width = wide.shape[:2]
    if width * height == 0:
        raise ImageError("the image has no pixels", "bad_input")
    rows = np.empty((height, 1 + 8 * width), dtype=np.uint8)
    rows[:, 0] = 0
    opaque = np.full((height, width, 1), 65535, dtype=np.uint16)
    samples = np.concatenate((wide, opaque), axis=2).astype(">u2")
    rows[:, 1:] = np.frombuffer(samples.tobytes(), dtype=np.uint8).reshape(height, 8 * width)
    parts: Sequence[tuple[bytes, bytes]] = (
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 16, 6, 0, 0, 0)),
        (b"IDAT", zlib.compress(rows.tobytes(), 1)),
        (b"IEND", b""),
    )
    chunks = (
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in parts
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)
