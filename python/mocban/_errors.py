"""Exceptions. Each has a stable ``code``, the ``path`` that it is about, and a ``hint``."""

from __future__ import annotations

import errno
import os
from typing import Any


def _number(error: OSError, number: int, path: str | None) -> None:
    error.errno, error.strerror, error.filename = number, os.strerror(number), path


class Error(Exception):
    """Base of all exceptions of this package.

    Parameters
    ----------
    hint : str
        One sentence that says what was seen and what to do; also the text of the exception.
    code : str
        Name of the problem that stays the same between versions.
    path : path-like, optional
        The file or folder that the problem is about.

    Examples
    --------
    >>> import mocban
    >>> try:
    ...     mocban.read_mesh("no-such-file.stl")
    ... except mocban.Error as error:
    ...     print(error.code, error.path)
    not_found no-such-file.stl
    """

    code: str
    path: str | None
    hint: str
    # The number of the system for exceptions that are an OSError too.
    _errno: int | None = None

    def __init__(self, hint: str, code: str = "unexpected", path: str | os.PathLike[str] | None = None) -> None:
        super().__init__(hint)
        self.hint = hint
        self.code = code
        self.path = None if path is None else os.fspath(path)
        if isinstance(self, OSError) and self._errno is not None:
            _number(self, self._errno, self.path)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.hint, self.code, self.path)

    def __str__(self) -> str:
        return self.hint


class InputError(Error, ValueError):
    """An input that cannot be used."""


class MeshError(InputError):
    """A mesh that cannot be read, or arrays that are no mesh."""


class ImageError(InputError):
    """An image that cannot be read, or an array that is no image."""


class UnitError(InputError):
    """A unit that is unknown, or with which the scan has an impossible size."""


class InputNotFound(InputError, FileNotFoundError):
    """An input file that does not exist."""

    _errno = errno.ENOENT


class SettingsError(Error, ValueError):
    """A setting that does not exist or has an invalid value."""


class ProjectError(Error):
    """A project, or a file written for it, that cannot be used."""


class NotAProject(ProjectError, FileNotFoundError):
    """A folder or address without a project."""

    _errno = errno.ENOENT


class ProjectVersionError(ProjectError):
    """A catalog that another version of mocban wrote, or that is no catalog."""


class ProjectBusy(ProjectError, TimeoutError):
    """Another process runs the project, writes the same output or locks the catalog."""

    _errno = errno.ETIMEDOUT


class ReadOnlyProject(ProjectError, PermissionError):
    """A project that may not be written to, or was opened with ``readonly=True``."""

    _errno = errno.EACCES


class StaleResult(ProjectError):
    """A result that has changed since it was read, so that a verdict on it was not recorded."""


class Cancelled(Error):
    """A run that its progress function stopped, or an alignment that was stopped. What a run has computed so far is stored."""


class Refused(Error):
    """A pair or block that is not aligned: with ``strict=True``, or when something is asked of a refused result."""
