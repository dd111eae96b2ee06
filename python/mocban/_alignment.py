"""Alignment of one pair, and its result."""

from __future__ import annotations

import difflib
import json
import logging
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from . import _native as _rust
from ._errors import Error, InputError, Refused, UnitError
from ._frozen import Frozen
from ._inputs import Mesh, Print, mesh_of, print_of
from ._settings import Settings, settings_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

_LOG = logging.getLogger("mocban")

#: Names of all metrics; the paper's method has no ``relief``.
METRICS = ("nl_ssim", "density", "ensemble", "relief")


class Refusal(NamedTuple):
    """Why a pair is not aligned.

    Attributes
    ----------
    code : str
        ``"no_solution"`` if the method finds none, ``"bad_input"`` if an input cannot be used.
    message : str
        One sentence with the values.
    path : str or None
        The file that is the likelier cause.
    """

    code: str
    message: str
    path: str | None = None


class MetricResult(Frozen):
    """The result of one metric.

    Attributes
    ----------
    metric : str
    threshold_depth : float
        Height of the threshold over the fitted surface, in units of the mesh; strokes lie above it.
    ssim, nl_ssim, iou, iou_box, dice : float
        Agreement of the strokes of the scan with the ink of the print.
    confidence : float or None
        Calibrated probability that the result is right, as in `Alignment`; None under the paper's method.
    """

    __slots__ = ("metric", "threshold_depth", "ssim", "nl_ssim", "iou", "iou_box", "dice", "confidence", "_native")
    metric: str
    threshold_depth: float
    ssim: float
    nl_ssim: float
    iou: float
    iou_box: float
    dice: float
    confidence: float | None
    _native: _rust.NativeAlignment

    def __init__(self, metric: str, numbers: Mapping[str, Any], native: _rust.NativeAlignment) -> None:
        self._set(metric=metric, _native=native, **numbers)

    @property
    def print_from_mesh(self) -> NDArray[np.float64]:
        """Map from mesh points to print pixels and heights, of shape (3, 4)."""
        import numpy as np

        return np.array(self._native.print_from_mesh(self.metric))

    def mask(self) -> NDArray[np.bool_]:
        """Return the strokes in the frame of the depth map, of shape (h, w)."""
        width, height, _ = self._native.levels()
        return self._native.mask(self.metric).reshape(height, width)

    def aligned_mask(self) -> NDArray[np.bool_]:
        """Return the strokes in the frame of the print, of shape (H, W)."""
        width, height = self._native.print_size()
        return self._native.aligned_mask(self.metric).reshape(height, width)

    def stroke_map(self) -> NDArray[np.uint8]:
        """Return where strokes and ink disagree by more than the spread of the ink explains.

        Returns
        -------
        array of uint8
            On the square canvas on which the scores are computed: 0 where they agree, 128 where strokes have no ink,
            255 where ink has no strokes.
        """
        side, grey = self._native.stroke_map(self.metric)
        return grey.reshape(side, side)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, MetricResult) or self._key() != other._key():
            return False
        return self._native is other._native or self._native.state() == other._native.state()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[Any, ...]:
        scores = (self.ssim, self.nl_ssim, self.iou, self.iou_box, self.dice)
        return (self.metric, self.threshold_depth, *scores, self.confidence)

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored_result, (self.metric, *self._native.state())

    def __repr__(self) -> str:
        return f"<mocban.MetricResult {self.metric}: IoU {self.iou:.3f}, {_confidence(self.confidence)}>"


def _restored_result(metric: str, numbers: str, images: bytes) -> MetricResult:
    return Results.of(_rust.NativeAlignment(numbers, images), (metric,))[metric]


class Results(Mapping[str, MetricResult]):
    """The results of an alignment by metric, in the order of the metrics. Cannot be changed."""

    __slots__ = ("_by_metric", "_native")

    def __init__(self, by_metric: Mapping[str, MetricResult], native: _rust.NativeAlignment | None) -> None:
        self._by_metric, self._native = dict(by_metric), native

    @classmethod
    def of(cls, native: _rust.NativeAlignment, metrics: Iterable[str]) -> Results:
        """Return the results of some metrics."""
        numbers = json.loads(native.json())["results"]
        return cls({name: MetricResult(name, numbers[name], native) for name in metrics}, native)

    def __getitem__(self, metric: str) -> MetricResult:
        return self._by_metric[plain_metric(metric)]

    def __iter__(self) -> Iterator[str]:
        return iter(self._by_metric)

    def __len__(self) -> int:
        return len(self._by_metric)

    def __reduce__(self) -> tuple[Any, ...]:
        if self._native is None:
            return Results, ({}, None)
        return _restored_results, (tuple(self), *self._native.state())

    def __repr__(self) -> str:
        return repr(self._by_metric)


def _restored_results(metrics: tuple[str, ...], numbers: str, images: bytes) -> Results:
    return Results.of(_rust.NativeAlignment(numbers, images), metrics)


class Alignment(Frozen):
    """The result of `align`. Frozen; can be pickled, hashed and compared by value.

    The attributes of the pose are those of the metric ``relief``, or of ``ensemble`` under the paper's method. All
    attributes except ``status`` and ``refusal`` are None, and ``results`` is empty, if the pair is refused.

    Attributes
    ----------
    status : {"aligned", "refused"}
    refusal : Refusal or None
    confidence : float or None
        Calibrated probability that the result is right: at most 5 degrees and 5 % of the character's height off, and an
        intersection over union of at least 0.7 with the true stroke tops. Look at results below 0.5 before you use them.
    rotation_deg : float or None
        How far the depth map is turned to lie on the print, in (-180, 180], positive clockwise.
    scale : float or None
        Print pixels per pixel of the depth map.
    shift_px : (float, float) or None
        Position of the depth map's centre relative to the centre of the print, in print pixels.
    mirrored : bool or None
        Always false: the depth map is mirrored so that it reads like the print.
    side : str or None
        Axis of the mesh towards which the carved face points, such as ``"+z"``.
    print_from_mesh : array of shape (3, 4) or None
        Rows 1 and 2 give the print pixel of a mesh point ``[x, y, z, 1]``, row 3 its height over the plane.
    results : mapping of str to MetricResult
    displaced : mapping or None
        The part of a torn print or a cracked block that lies elsewhere than the pose puts it: ``ink_share``, ``shift_px``,
        ``angle_deg``, its own ``print_from_depth``, and the line beside it as ``normal`` and ``offset_px`` in the print.
    warnings : tuple of str
        What may be wrong with the mesh or the print, such as vertices without a position.

    Examples
    --------
    >>> import mocban
    >>> found = mocban.align("pair.stl", "pair.png")
    >>> found.status
    'aligned'
    >>> pixels = found.project([[0.0, 0.0, 0.0]])
    """

    __slots__ = (
        "status", "refusal", "confidence", "rotation_deg", "scale", "shift_px", "mirrored", "side", "print_from_mesh",
        "results", "displaced", "warnings", "_native", "_first",
    )  # fmt: skip
    status: Literal["aligned", "refused"]
    refusal: Refusal | None
    confidence: float | None
    rotation_deg: float | None
    scale: float | None
    shift_px: tuple[float, float] | None
    mirrored: bool | None
    side: str | None
    print_from_mesh: NDArray[np.float64] | None
    results: Mapping[str, MetricResult]
    displaced: Mapping[str, Any] | None
    warnings: tuple[str, ...]
    _native: _rust.NativeAlignment | None
    _first: str | None

    def __init__(
        self,
        native: _rust.NativeAlignment | None,
        refusal: Refusal | None = None,
        metrics: Iterable[str] | None = None,
    ) -> None:
        if native is None:
            names = ("confidence", "rotation_deg", "scale", "shift_px", "mirrored", "side", "print_from_mesh")
            self._set(status="refused", refusal=refusal, results=Results({}, None), _native=None, _first=None)
            self._set(displaced=None, warnings=(), **dict.fromkeys(names))
            return
        import numpy as np

        numbers = json.loads(native.json())
        all_results = numbers["results"]
        known = [name for name in METRICS if name in all_results]
        chosen = tuple(known) if metrics is None else tuple(metrics)
        results = {name: MetricResult(name, all_results[name], native) for name in chosen}
        matrix = np.array(numbers["print_from_mesh"])
        matrix.setflags(write=False)
        self._set(
            status="aligned",
            refusal=None,
            confidence=numbers["confidence"],
            rotation_deg=numbers["rotation_deg"],
            scale=numbers["scale"],
            shift_px=tuple(numbers["shift_px"]),
            mirrored=numbers["mirrored"],
            side=numbers["side"],
            print_from_mesh=matrix,
            results=Results(results, native),
            displaced=None if numbers["displaced"] is None else MappingProxyType(numbers["displaced"]),
            warnings=tuple(numbers["warnings"]),
            _native=native,
            _first="relief" if "relief" in all_results else "ensemble",
        )

    def _aligned(self) -> _rust.NativeAlignment:
        if self._native is None:
            assert self.refusal is not None
            raise Refused(self.refusal.message, self.refusal.code, self.refusal.path)
        return self._native

    def project(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return print pixels and heights of mesh points.

        Parameters
        ----------
        points : array_like of shape (N, 3)

        Returns
        -------
        array of shape (N, 3)
            x and y in print pixels, and the height over the plane in units of the mesh. The centre of the pixel at the
            top left is (0, 0).
        """
        self._aligned()
        import numpy as np

        matrix = self.print_from_mesh
        assert matrix is not None
        return _points(points, 3, np) @ matrix[:, :3].T + matrix[:, 3]

    def lift(self, px: ArrayLike) -> NDArray[np.float64]:
        """Return the points of the scanned surface that lie on print pixels.

        Parameters
        ----------
        px : array_like of shape (N, 2)
            x and y in print pixels.

        Returns
        -------
        array of shape (N, 3)
            Mesh points, with the height of the nearest pixel of the depth map; NaN where it has no data.
        """
        native = self._aligned()
        import numpy as np

        outcomes = json.loads(native.outcomes())
        metrics = outcomes["register"]["metrics"]
        pose = next(found["print_from_depth"] for found in metrics if found["metric"] == self._first)
        width, height, flat = native.levels()
        depth = _inverse(pose, np)(_points(px, 2, np))
        return _surface(depth, flat.reshape(height, width), outcomes["scale"], outcomes["fit"], np)

    def print_mask(self) -> NDArray[np.bool_]:
        """Return the ink of the print, of shape (H, W)."""
        native = self._aligned()
        width, height = native.print_size()
        return native.print_mask().reshape(height, width)

    def depth(self) -> NDArray[np.float64]:
        """Return the depth map: heights over the fitted surface in units of the mesh; NaN without data."""
        native = self._aligned()
        import numpy as np

        width, height, flat = native.levels()
        scale = json.loads(native.outcomes())["scale"]
        return heights_of(flat.reshape(height, width), scale, np)

    def overlay(self, metric: str | None = None) -> NDArray[np.uint8]:
        """Return the print with the edges of the strokes, of shape (H, W, 3); small prints are enlarged.

        Parameters
        ----------
        metric : str, optional
            That of the pose by default.
        """
        native = self._aligned()
        assert self._first is not None
        width, height, flat = native.overlay(self._first if metric is None else metric)
        return flat.reshape(height, width, 3)

    def save(self, dir: str | os.PathLike[str]) -> None:
        """Write the files of ``mocban align -o DIR``. Files that were written there earlier are replaced.

        Raises
        ------
        ProjectError
            If the folder holds other files, or one that somebody changed, or cannot be written.
        """
        warning = self._aligned().save(os.fspath(dir))
        if warning:
            _LOG.warning("%s", warning)

    def _state(self) -> tuple[Any, ...]:
        names = tuple(self.results)
        return (self.refusal, names, None if self._native is None else self._native.state())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Alignment) and self._state() == other._state()

    def __hash__(self) -> int:
        return hash((self.refusal, tuple(self.results.values())))

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, self._state()

    def __repr__(self) -> str:
        if self.refusal is not None:
            return f"<mocban.Alignment refused: {self.refusal.message}>"
        assert self.shift_px is not None
        x, y = self.shift_px
        return (
            f"<mocban.Alignment {_confidence(self.confidence)}, turned by {self.rotation_deg:.2f} degrees, "
            f"shifted by {x:.1f}, {y:.1f} px>"
        )

    def _repr_html_(self) -> str:
        import base64
        from html import escape

        if self._native is None:
            return f"<p>{escape(repr(self))}</p>"
        assert self._first is not None
        picture = base64.b64encode(self._native.overlay_png(self._first)).decode()
        head = "".join(f"<th>{name}</th>" for name in ("metric", "threshold", "SSIM", "IoU", "Dice", "confidence"))
        rows = "".join(_row(result) for result in self.results.values())
        text = escape(repr(self).strip("<>"))
        return (
            f'<figure><img src="data:image/png;base64,{picture}" alt="Print with the edges of the strokes">'
            f"<figcaption>{text}</figcaption></figure><table><tr>{head}</tr>{rows}</table>"
        )


def _row(result: MetricResult) -> str:
    numbers = (result.threshold_depth, result.ssim, result.iou, result.dice, result.confidence)
    cells = "".join(f"<td>{'' if number is None else format(number, '.3f')}</td>" for number in numbers)
    return f"<tr><td>{result.metric}</td>{cells}</tr>"


def _restored(refusal: Refusal | None, names: tuple[str, ...], state: tuple[str, bytes] | None) -> Alignment:
    native = None if state is None else _rust.NativeAlignment(*state)
    return Alignment(native, refusal, names)


def _confidence(value: float | None) -> str:
    return "confidence not known" if value is None else f"confidence {value:.2f}"


def _points(values: ArrayLike, columns: int, np: Any) -> Any:
    points = np.asarray(values, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != columns:
        text = f"the points have the shape {points.shape}; give an array of shape (N, {columns})"
        raise InputError(text, "bad_input")
    return points


def _inverse(affine: list[list[float]], np: Any) -> Any:
    matrix = np.array(affine)
    linear = np.linalg.inv(matrix[:, :2])
    return lambda points: (points - matrix[:, 2]) @ linear.T


def heights_of(levels: Any, scale: Mapping[str, Any], np: Any) -> Any:
    heights = scale["height_min"] + (levels.astype(np.float64) - 1.0) * scale["height_per_level"]
    return np.where(levels == 0, np.nan, heights)


def _surface(depth: Any, levels: Any, scale: Mapping[str, Any], fit: Mapping[str, Any], np: Any) -> Any:
    """Return the mesh points at pixels of the depth map."""
    height, width = levels.shape
    with np.errstate(invalid="ignore"):
        inside = (depth[:, 0] > -0.5) & (depth[:, 1] > -0.5)
        inside &= (depth[:, 0] < width - 0.5) & (depth[:, 1] < height - 0.5)
    nearest = np.rint(np.where(inside[:, None], depth, 0.0)).astype(np.int64).clip(0, [width - 1, height - 1])
    over_surface = heights_of(levels[nearest[:, 1], nearest[:, 0]], scale, np)
    z = np.where(inside, over_surface, np.nan)
    plane = _inverse(scale["depth_from_plane"], np)(depth)
    x, y = plane[:, 0], plane[:, 1]
    if scale["bow"] is not None:
        c = scale["bow"]
        z = z + c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y
    matrix = np.array(fit["plane_from_mesh"])
    # The inverse of a rigid transform.
    points = (np.column_stack((x, y, z)) - matrix[:3, 3]) @ matrix[:3, :3]
    points[np.isnan(z)] = np.nan
    return points


def align(
    mesh: Mesh | str | os.PathLike[str],
    print: Print | str | os.PathLike[str] | ArrayLike,
    *,
    metrics: Iterable[str] | None = None,
    settings: Settings | str | None = None,
    strict: bool = False,
    unit: str | None = None,
    scanned_face_down: bool | None = None,
) -> Alignment:
    """Align a scan with its print.

    The result is that of ``mocban align`` and of a project with this pair. The GIL is released; Ctrl-C stops the
    computation at once.

    Parameters
    ----------
    mesh : Mesh or path-like
        The scan.
    print : Print, path-like or array_like
        The image of the print.
    metrics : iterable of str, optional
        Metrics whose results to keep; all of the method by default.
    settings : Settings or name of a preset, optional
    strict : bool
        Whether a refusal is an exception.
    unit : {"mm", "cm", "m", "in"}, optional
        Unit of a file; not known by default. A `Mesh` has its own.
    scanned_face_down : bool, optional
        Whether the carved face points towards -z of the mesh; found out by default. It decides only where the scan does
        not show it; ``warnings`` of the result has a sentence if the carving was found on the other side.

    Returns
    -------
    Alignment
        With the status ``"refused"`` if scan and print do not match, unless ``strict``.

    Raises
    ------
    MeshError, ImageError
        If an input cannot be used.
    UnitError
        If the scan has an impossible size with the unit of the mesh.
    Refused
        If the pair is refused and ``strict`` is true.

    Examples
    --------
    >>> import mocban
    >>> found = mocban.align("pair.stl", "pair.png")
    >>> found.results["relief"].iou > 0.6
    True
    """
    chosen = settings_of(settings)
    names = None if metrics is None else metric_names(metrics, chosen)
    return aligned(mesh, print, names, chosen, strict=strict, unit=unit, scanned_face_down=scanned_face_down)


def aligned(
    mesh: Mesh | str | os.PathLike[str],
    print: Print | str | os.PathLike[str] | ArrayLike,
    names: Iterable[str] | None,
    chosen: Settings,
    *,
    strict: bool = False,
    unit: str | None = None,
    scanned_face_down: bool | None = None,
    cancel: _rust.NativeCancel | None = None,
) -> Alignment:
    """Align a pair. ``cancel`` stops it from another thread, which raises `Cancelled`."""
    scan, image = mesh_of(mesh, chosen, unit, cancel), print_of(print, chosen, cancel)
    if warnings := scan.warnings:
        raise UnitError(f"{scan.path or 'the mesh'}: {warnings[0]}", "wrong_unit", scan.path)
    native, refused = _rust.align_pair(scan._native, image._native, chosen._native, scanned_face_down, cancel)
    if refused is None:
        return Alignment(native, None, names)
    code, message, is_of_print = refused
    path = image.path if is_of_print else scan.path
    refusal = Refusal(code, f"{path or ('the print' if is_of_print else 'the mesh')}: {message}", path)
    if strict:
        raise Refused(refusal.message, refusal.code, refusal.path)
    return Alignment(None, refusal)


def plain_metric(name: str) -> str:
    """Return the name of a metric that is written with capitals, blanks or hyphens; anything else as it is."""
    plain = "_".join(re.split(r"[\s_-]+", name.strip().lower())) if isinstance(name, str) else name
    return plain if plain in METRICS else name


def unknown_metric(name: object, known: Iterable[str]) -> InputError:
    """Return the error of a metric that is not one of the known ones, with a similar one."""
    names = tuple(known)
    similar = difflib.get_close_matches(str(name).lower(), names, 1)
    hint = f"; did you mean {similar[0]!r}?" if similar else ""
    return InputError(f"there is no metric {name!r}, only {', '.join(names)}{hint}", "usage")


def metric_names(metrics: Iterable[str], chosen: Settings) -> tuple[str, ...]:
    """Return the names of metrics, all of which the method gives."""
    names = tuple(map(plain_metric, (metrics,) if isinstance(metrics, str) else metrics))
    if not names:
        raise InputError("metrics is empty; leave it out for all metrics", "usage")
    known = METRICS if chosen["pipeline.method"] == "default" else METRICS[:-1]
    for name in names:
        if name not in known:
            raise unknown_metric(name, known)
    return names
