"""Single stages of the method, each usable alone."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from . import _native as _rust
from ._alignment import heights_of
from ._frozen import Frozen
from ._inputs import Mesh, Print, mesh_of, print_of
from ._settings import Settings, settings_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray


class Surface(Frozen):
    """The surface of the stroke tops of a scan. Made by `fit_surface`.

    Attributes
    ----------
    curvature : tuple of 6 floats or None
        Height over the plane is ``c[0] + c[1] x + c[2] y + c[3] x**2 + c[4] x y + c[5] y**2``; None for a flat block.
    inlier_ratio : float
        Fraction of the sampled points that lie on the surface.
    rms : float
        Root mean square distance of these points to the surface, in units of the mesh.
    relief : float
        Depth of the carving, in units of the mesh.
    side_confidence : float
        Confidence that this side is the carved one, from 0 (a guess) to 1.
    """

    __slots__ = ("_json", "curvature", "inlier_ratio", "rms", "relief", "side_confidence")
    _json: str
    curvature: tuple[float, ...] | None
    inlier_ratio: float
    rms: float
    relief: float
    side_confidence: float

    def __init__(self, numbers: str) -> None:
        fit = json.loads(numbers)
        self._set(
            _json=numbers,
            curvature=None if fit["bow"] is None else tuple(fit["bow"]),
            inlier_ratio=fit["inlier_ratio"],
            rms=fit["rms"],
            relief=fit["relief"],
            side_confidence=fit["side"]["confidence"],
        )

    @property
    def plane_from_mesh(self) -> NDArray[np.float64]:
        """Map from mesh points to the frame of the plane, of shape (4, 4); z points out of the block."""
        import numpy as np

        return np.array(json.loads(self._json)["plane_from_mesh"])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Surface) and self._json == other._json

    def __hash__(self) -> int:
        return hash(self._json)

    def __reduce__(self) -> tuple[Any, ...]:
        return Surface, (self._json,)

    def __repr__(self) -> str:
        return f"<mocban.Surface: carving {self.relief:.3f} deep, {self.inlier_ratio:.0%} inliers>"


class DepthMap(Frozen):
    """Heights over a surface, mirrored so that they read like the print. Made by `depth_map`.

    Attributes
    ----------
    levels : array of uint16 of shape (h, w)
        0 without data; 1 to 65535 are linear in height.
    mesh_unit_per_px : float
        Side of a pixel, in units of the mesh.
    height_min, height_per_level : float
        Height of level 1, and between two levels.
    """

    __slots__ = ("levels", "mesh_unit_per_px", "height_min", "height_per_level", "_scale")
    levels: NDArray[np.uint16]
    mesh_unit_per_px: float
    height_min: float
    height_per_level: float
    _scale: str

    def __init__(self, levels: NDArray[np.uint16], scale: str) -> None:
        numbers = json.loads(scale)
        levels.setflags(write=False)
        names = ("mesh_unit_per_px", "height_min", "height_per_level")
        self._set(levels=levels, _scale=scale, **{name: numbers[name] for name in names})

    @property
    def heights(self) -> NDArray[np.float64]:
        """Heights over the surface in units of the mesh; NaN without data."""
        import numpy as np

        return heights_of(self.levels, self._numbers(), np)

    @property
    def depth_from_plane(self) -> NDArray[np.float64]:
        """Map from x and y of the plane to pixels, of shape (2, 3)."""
        import numpy as np

        return np.array(self._numbers()["depth_from_plane"])

    def _numbers(self) -> Mapping[str, Any]:
        return json.loads(self._scale)

    def __eq__(self, other: object) -> bool:
        import numpy as np

        if not isinstance(other, DepthMap):
            return False
        return self._scale == other._scale and np.array_equal(self.levels, other.levels)

    def __hash__(self) -> int:
        return hash((self._scale, self.levels.shape))

    def __reduce__(self) -> tuple[Any, ...]:
        return DepthMap, (self.levels, self._scale)

    def __repr__(self) -> str:
        height, width = self.levels.shape
        return f"<mocban.DepthMap: {width} x {height} px of {self.mesh_unit_per_px:.4f}>"


def fit_surface(
    mesh: Mesh | str | os.PathLike[str],
    print: Print | str | os.PathLike[str] | ArrayLike | None = None,
    *,
    settings: Settings | str | None = None,
    scanned_face_down: bool | None = None,
) -> Surface:
    """Fit a surface to the stroke tops of a scan, on its carved side.

    Parameters
    ----------
    mesh : Mesh or path-like
    print : Print, path-like or array_like, optional
        Helps to find the carved side.
    settings : Settings or name of a preset, optional
    scanned_face_down : bool, optional
        Whether the carved face points towards -z of the mesh; found out by default. It decides only where the scan does not
        show it.

    Returns
    -------
    Surface

    Raises
    ------
    MeshError
        If no surface is found or nothing is carved.

    Examples
    --------
    >>> import mocban
    >>> mocban.fit_surface("pair.stl", "pair.png").plane_from_mesh.shape
    (4, 4)
    """
    chosen = settings_of(settings)
    scan = mesh_of(mesh, chosen)._native
    image = None if print is None else print_of(print, chosen)._native
    return Surface(_rust.fit_surface(scan, image, chosen._native, scanned_face_down))


def depth_map(
    mesh: Mesh | str | os.PathLike[str],
    surface: Surface | None = None,
    *,
    settings: Settings | str | None = None,
) -> DepthMap:
    """Render the heights of a scan over a surface.

    Parameters
    ----------
    mesh : Mesh or path-like
    surface : Surface, optional
        That of `fit_surface` by default.
    settings : Settings or name of a preset, optional

    Returns
    -------
    DepthMap

    Raises
    ------
    MeshError
        If no surface is found, or the map would be empty or too large.

    Examples
    --------
    >>> import mocban
    >>> max(mocban.depth_map("pair.stl").levels.shape)
    512
    """
    chosen = settings_of(settings)
    scan = mesh_of(mesh, chosen)
    fitted = fit_surface(scan, settings=chosen) if surface is None else surface
    width, height, levels, scale = _rust.depth_map(scan._native, fitted._json, chosen._native)
    return DepthMap(levels.reshape(height, width), scale)


def print_mask(
    print: Print | str | os.PathLike[str] | ArrayLike, *, settings: Settings | str | None = None
) -> NDArray[np.bool_]:
    """Return the ink of a print in its likeliest interpretation. `align` may choose another one.

    Parameters
    ----------
    print : Print, path-like or array_like
    settings : Settings or name of a preset, optional
        Only the limits of files are used.

    Returns
    -------
    array of bool of shape (H, W)

    Raises
    ------
    ImageError
        If the print is too small or has no contrast.

    Examples
    --------
    >>> import mocban
    >>> ink = mocban.print_mask("pair.png")
    >>> bool(0.01 < ink.mean() < 0.7)
    True
    """
    image = print_of(print, settings_of(settings))
    width, height = image.size
    return image._native.ink().reshape(height, width)
