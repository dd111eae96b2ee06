"""Scans and prints, from arrays and files."""

from __future__ import annotations

import logging
import os
from typing import TYPE_CHECKING, Any

from . import _native as _rust
from ._errors import ImageError, MeshError, UnitError
from ._frozen import Frozen
from ._settings import Settings, settings

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

_LOG = logging.getLogger("mocban")

#: Modes of PIL images whose arrays have the meaning that `Print` expects.
_PIL_MODES = ("L", "LA", "RGB", "RGBA", "I;16")


def _flat(array: NDArray[Any], dtype: Any) -> Any:
    """Return the values in C order, contiguous and in the byte order of the machine; copies only if needed."""
    import numpy as np

    return np.ascontiguousarray(array, dtype=dtype).reshape(-1)


class Mesh(Frozen):
    """A scan: a triangle mesh or a set of points, in its own frame and unit.

    Parameters
    ----------
    vertices : array_like of shape (N, 3)
        Positions, such as those of trimesh or Open3D. They are copied once and keep their order. 32-bit floats stay
        32-bit.
    faces : array_like of shape (M, 3), optional
        Indices of corners, counted from 0. Without faces, the vertices are a set of points.
    unit : {"mm", "cm", "m", "in"} or None
        Unit of the positions.

    Attributes
    ----------
    unit : str or None
    warnings : tuple of str
        What may be wrong with the mesh.
    path : str or None
        The file that it was read from.

    Raises
    ------
    MeshError
        If the arrays have another shape, a coordinate is not finite, or an index is out of range.
    UnitError
        If the unit is unknown.

    Examples
    --------
    >>> import mocban
    >>> mesh = mocban.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> mesh
    <mocban.Mesh: 3 vertices, 1 face, mm>
    """

    __slots__ = ("_native",)
    _native: _rust.NativeMesh

    def __init__(self, vertices: ArrayLike, faces: ArrayLike | None = None, *, unit: str | None = "mm") -> None:
        import numpy as np

        if hasattr(vertices, "vertices"):
            text = f"the vertices are a {type(vertices).__name__}; give its arrays: mocban.Mesh(mesh.vertices, mesh.faces)"
            raise MeshError(text, "bad_input")
        points = _numbers(vertices, "vertices", MeshError)
        if points.dtype.kind not in "fiu":
            raise MeshError(f"the vertices have the type {points.dtype}; give numbers", "bad_input")
        if points.ndim != 2 or points.shape[1] != 3:
            text = f"the vertices have the shape {points.shape}; give an array of shape (N, 3)"
            raise MeshError(text, "bad_input")
        is_single = points.dtype.kind == "f" and points.dtype.itemsize <= 4
        flat = _flat(points, np.float32 if is_single else np.float64)
        corners = None if faces is None else _corners(faces)
        single, double = (flat, None) if is_single else (None, flat)
        self._set(_native=_rust.NativeMesh(single, double, corners, unit))

    @classmethod
    def _of(cls, native: _rust.NativeMesh) -> Mesh:
        mesh = cls.__new__(cls)
        mesh._set(_native=native)
        return mesh

    @classmethod
    def from_heights(cls, z: ArrayLike, *, mm_per_px: float, invalid: float = float("nan")) -> Mesh:
        """Return the surface of a depth map, in millimetres.

        Parameters
        ----------
        z : array_like of shape (H, W)
            Heights in millimetres, seen as one looks at the block: row 0 is at the top, and the face points to the
            viewer (+z). The characters read in mirror writing.
        mm_per_px : float
            Side of a pixel.
        invalid : float
            Value of pixels without data.

        Returns
        -------
        Mesh
            A vertex for each pixel with data, row by row, and two triangles between four such pixels.

        Examples
        --------
        >>> import mocban
        >>> mocban.Mesh.from_heights([[0.0, 0.1], [0.2, 0.3]], mm_per_px=0.05)
        <mocban.Mesh: 4 vertices, 2 faces, mm>
        """
        import numpy as np

        try:
            mm_per_px = float(mm_per_px)
        except (TypeError, ValueError):
            raise MeshError(f"mm_per_px is {mm_per_px!r}; give a number", "bad_input") from None
        heights = _numbers(z, "heights", MeshError)
        if heights.ndim != 2 or heights.dtype.kind not in "fiu":
            text = f"the heights have the shape {heights.shape} and type {heights.dtype}; give numbers of shape (H, W)"
            raise MeshError(text, "bad_input")
        if not (np.isfinite(mm_per_px) and mm_per_px > 0):
            raise MeshError(f"mm_per_px is {mm_per_px}; give a length above 0", "bad_input")
        heights = heights.astype(np.float64)
        valid = ~np.isnan(heights) if np.isnan(invalid) else heights != invalid
        rows, columns = np.nonzero(valid)
        points = np.column_stack((columns * mm_per_px, -rows * mm_per_px, heights[valid]))
        number = np.full(heights.shape, -1, dtype=np.int64)
        number[valid] = np.arange(len(points))
        a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
        whole = (a >= 0) & (b >= 0) & (c >= 0) & (d >= 0)
        a, b, c, d = a[whole], b[whole], c[whole], d[whole]
        faces = np.concatenate((np.column_stack((a, b, c)), np.column_stack((a, c, d))))
        return cls(points, faces, unit="mm")

    @property
    def vertices(self) -> NDArray[np.float64]:
        """Positions, as a new read-only array of shape (N, 3)."""
        return _read_only(self._native.vertices().reshape(-1, 3))

    @property
    def faces(self) -> NDArray[np.uint32] | None:
        """Indices of corners, as a new read-only array of shape (M, 3); None for a set of points."""
        return _read_only(self._native.faces().reshape(-1, 3)) if self._native.counts()[1] else None

    @property
    def unit(self) -> str | None:
        """Unit of the positions; None if it is not known."""
        return self._native.unit()

    @property
    def warnings(self) -> tuple[str, ...]:
        """What may be wrong with the mesh."""
        return tuple(self._native.warnings())

    @property
    def path(self) -> str | None:
        """The file that it was read from."""
        path = self._native.path
        return None if path is None else os.fspath(path)

    def __reduce__(self) -> tuple[Any, ...]:
        return _mesh, (self.vertices, self.faces, self.unit)

    def __eq__(self, other: object) -> bool:
        import numpy as np

        if not isinstance(other, Mesh) or self._native.counts() != other._native.counts():
            return False
        return (
            self.unit == other.unit
            and np.array_equal(self.vertices, other.vertices)
            and np.array_equal(self._native.faces(), other._native.faces())
        )

    def __hash__(self) -> int:
        return hash((self._native.counts(), self.unit))

    def __repr__(self) -> str:
        vertices, faces = self._native.counts()
        parts = [f"{vertices} vert{'ex' if vertices == 1 else 'ices'}", f"{faces} face{'' if faces == 1 else 's'}", self.unit or "unit not known"]
        return f"<mocban.Mesh: {', '.join(parts)}>"


def _mesh(vertices: Any, faces: Any, unit: str | None) -> Mesh:
    return Mesh(vertices, faces, unit=unit)


def _numbers(values: Any, what: str, error: type[MeshError] | type[ImageError]) -> NDArray[Any]:
    import numpy as np

    if values is None:
        raise error(f"the {what} are None; give an array (was the file read?)", "bad_input")
    if isinstance(values, (str, os.PathLike)):
        raise error(f"the {what} are the path {os.fspath(values)!r}; give an array, or read the file first", "bad_input")
    if isinstance(values, (bytes, bytearray)) or hasattr(values, "read"):
        raise error(f"the {what} are the bytes of a file; give an array, or the path of the file", "bad_input")
    try:
        array = np.asarray(values)
    except (ValueError, TypeError, RuntimeError) as reason:
        raise error(f"the {what} are no array: {reason}", "bad_input") from reason
    if np.ma.isMaskedArray(values) and np.ma.getmaskarray(values).any():
        raise error(f"the {what} are a masked array; fill or remove the masked values", "bad_input")
    return array


def _corners(faces: ArrayLike) -> Any:
    import numpy as np

    corners = _numbers(faces, "faces", MeshError)
    if corners.size == 0:
        return None
    if corners.ndim != 2 or corners.shape[1] != 3:
        text = f"the faces have the shape {corners.shape}; give triangles as an array of shape (M, 3)"
        raise MeshError(text, "bad_input")
    if corners.dtype.kind not in "iu":
        raise MeshError(f"the faces have the type {corners.dtype}; give integers", "bad_input")
    if corners.dtype != np.uint32:
        lowest, highest = int(corners.min()), int(corners.max())
        if lowest < 0 or highest >= 2**32:
            text = f"the faces refer to vertex {lowest if lowest < 0 else highest}; indices count from 0"
            raise MeshError(text, "bad_input")
    return _flat(corners, np.uint32)


def _read_only(array: Any) -> Any:
    array.setflags(write=False)
    return array


class Print(Frozen):
    """The image of a print.

    Parameters
    ----------
    image : array_like of shape (H, W) or (H, W, C)
        Grey, grey with alpha, RGB or RGB with alpha (C of 1 to 4), as uint8 (255 is white) or uint16 (65535 is white).
        Transparent pixels count as white. OpenCV's arrays are BGR, and those of CMYK images have four channels too: convert
        them first. Lists of whole numbers from 0 to 255 count as uint8.

    Attributes
    ----------
    size : tuple of int
        Width and height in pixels.
    dpi : tuple of float or None
        Pixels per inch, if the image is from a file that says so.
    warnings : tuple of str
        What may be wrong with the image, such as a colour profile that cannot be applied.
    path : str or None
        The file that it was read from.

    Raises
    ------
    ImageError
        If the array has another shape or type, or more pixels than the default of ``limits.image.max_pixels``.

    Examples
    --------
    >>> import numpy, mocban
    >>> mocban.Print(numpy.full((40, 30), 255, dtype=numpy.uint8))
    <mocban.Print: 30 x 40 px>
    """

    __slots__ = ("_native",)
    _native: _rust.NativePrint

    def __init__(self, image: ArrayLike) -> None:
        self._fill(image, settings()._native.max_pixels)

    def _fill(self, image: ArrayLike, most: int) -> None:
        import numpy as np

        mode = getattr(image, "mode", None) if type(image).__module__.startswith("PIL.") else None
        if mode is not None and mode not in _PIL_MODES:
            raise ImageError(f'the image has the mode {mode}; convert it first: image.convert("RGB")', "bad_input")
        pixels = _numbers(image, "pixels", ImageError)
        if isinstance(image, (list, tuple)) and pixels.dtype.kind == "i" and pixels.size:
            if 0 <= pixels.min() and pixels.max() <= 255:
                pixels = pixels.astype(np.uint8)
        if pixels.dtype.newbyteorder("=") not in (np.uint8, np.uint16):
            hints = {"b": "; a mask of ink is 255 * ~mask", "f": "; numbers from 0 to 1 are (255 * image).round()"}
            hint = hints.get(pixels.dtype.kind, "")
            text = f"the image has the type {pixels.dtype}; give uint8 (255 is white) or uint16 (65535 is white){hint}"
            raise ImageError(text, "bad_input")
        if pixels.ndim == 2:
            pixels = pixels[:, :, np.newaxis]
        if pixels.ndim != 3 or not 1 <= pixels.shape[2] <= 4:
            text = f"the image has the shape {pixels.shape}; give an array of shape (H, W) or (H, W, 1 to 4)"
            raise ImageError(text, "bad_input")
        height, width, channels = pixels.shape
        if height * width > most:
            text = f"the image has {height * width} pixels, more than limits.image.max_pixels ({most}); make it smaller"
            raise ImageError(text, "bad_input")
        flat = _flat(pixels, pixels.dtype.newbyteorder("="))
        eight, sixteen = (flat, None) if flat.dtype == np.uint8 else (None, flat)
        self._set(_native=_rust.NativePrint(eight, sixteen, width, height, channels))

    @classmethod
    def _of(cls, native: _rust.NativePrint) -> Print:
        image = cls.__new__(cls)
        image._set(_native=native)
        return image

    @property
    def image(self) -> NDArray[np.uint8]:
        """Colours of the upright image in 8 bits, as a new read-only array of shape (H, W, 3)."""
        width, height = self.size
        return _read_only(self._native.rgb8().reshape(height, width, 3))

    @property
    def image16(self) -> NDArray[np.uint16]:
        """Colours of the upright image in 16 bits, as they are aligned, of shape (H, W, 3)."""
        width, height = self.size
        return _read_only(self._native.rgb16().reshape(height, width, 3))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self._native.size

    @property
    def dpi(self) -> tuple[float, float] | None:
        """Pixels per inch of the upright image, horizontally and vertically, as its file says; None if it does not.

        It is read from the PNG, JFIF or TIFF header or from EXIF. It does not change an alignment, and neither a comparison
        nor a pickle keeps it.
        """
        return self._native.dpi

    @property
    def warnings(self) -> tuple[str, ...]:
        """What may be wrong with the image."""
        warning = self._native.warning
        return () if warning is None else (warning,)

    @property
    def path(self) -> str | None:
        """The file that it was read from."""
        path = self._native.path
        return None if path is None else os.fspath(path)

    def __reduce__(self) -> tuple[Any, ...]:
        # RGB and alpha, because 16 bits without alpha may be read as those of a camera of fewer bits.
        import numpy as np

        wide = self.image16
        opaque = np.full((*wide.shape[:2], 1), 65535, dtype=np.uint16)
        return Print, (np.concatenate((wide, opaque), axis=2),)

    def __eq__(self, other: object) -> bool:
        import numpy as np

        return isinstance(other, Print) and np.array_equal(self.image16, other.image16)

    def __hash__(self) -> int:
        return hash(self.size)

    def __repr__(self) -> str:
        width, height = self.size
        return f"<mocban.Print: {width} x {height} px>"


def read_mesh(path: str | os.PathLike[str], *, unit: str | None = None) -> Mesh:
    """Read a scan: OBJ, PLY or STL, or points as PLY or XYZ.

    Parameters
    ----------
    path : path-like
    unit : {"mm", "cm", "m", "in"} or None
        Unit of the file; None if it is not known.

    Returns
    -------
    Mesh
        With the vertices in the order of the file.

    Raises
    ------
    InputNotFound
        If there is no such file.
    MeshError
        If it is no mesh, or larger than the limits of `settings`.

    Examples
    --------
    >>> import mocban
    >>> mesh = mocban.read_mesh("pair.stl")
    >>> mesh.vertices.shape[1]
    3
    """
    return _logged(Mesh._of(_rust.read_mesh(os.fspath(path), unit, settings()._native, None)))


def read_print(path: str | os.PathLike[str]) -> Print:
    """Read the image of a print: PNG, JPEG or TIFF. It is turned upright, and its colours are converted to sRGB.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    Print

    Raises
    ------
    InputNotFound
        If there is no such file.
    ImageError
        If it is no image, or larger than the limits of `settings`.

    Examples
    --------
    >>> import mocban
    >>> mocban.read_print("pair.png").image.dtype
    dtype('uint8')
    """
    return _logged(Print._of(_rust.read_print(os.fspath(path), settings()._native, None)))


def _logged(read: Any) -> Any:
    for warning in read.warnings:
        _LOG.warning("%s: %s", read.path, warning)
    return read


def mesh_of(
    mesh: Mesh | str | os.PathLike[str],
    chosen: Settings,
    unit: str | None = None,
    cancel: _rust.NativeCancel | None = None,
) -> Mesh:
    """Return a mesh, or read its file."""
    if isinstance(mesh, Mesh):
        if unit is not None and unit.strip().lower() != mesh.unit:
            text = f"the unit is {unit}, but that of the mesh is {mesh.unit or 'not known'}; give it to the mesh"
            raise UnitError(text, "unknown_unit")
        return mesh
    if isinstance(mesh, (str, os.PathLike)):
        return _logged(Mesh._of(_rust.read_mesh(os.fspath(mesh), unit, chosen._native, cancel)))
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        raise MeshError("give mocban.Mesh(mesh.vertices, mesh.faces, unit=...) instead of the object", "bad_input")
    raise MeshError(f"the mesh is a {type(mesh).__name__}; give a mocban.Mesh or a path", "bad_input")


def print_of(
    image: Print | str | os.PathLike[str] | ArrayLike,
    chosen: Settings,
    cancel: _rust.NativeCancel | None = None,
) -> Print:
    """Return a print, read its file, or copy its array."""
    if isinstance(image, Print):
        return image
    if isinstance(image, (str, os.PathLike)):
        return _logged(Print._of(_rust.read_print(os.fspath(image), chosen._native, cancel)))
    found = Print.__new__(Print)
    found._fill(image, chosen._native.max_pixels)
    return found
