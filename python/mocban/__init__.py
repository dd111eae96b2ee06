"""Aligns 3D scans of carved woodblock characters with images of their prints.

Examples
--------
>>> import mocban
>>> found = mocban.align("pair.stl", "pair.png")
>>> found.status
'aligned'
"""

from __future__ import annotations

import logging
import os

from . import _native
from ._alignment import Alignment, MetricResult, Refusal, align
from ._blocks import BlockAlignment, BlockCharacter, align_block
from ._errors import (
    Cancelled,
    Error,
    ImageError,
    InputError,
    InputNotFound,
    MeshError,
    NotAProject,
    ProjectBusy,
    ProjectError,
    ProjectVersionError,
    ReadOnlyProject,
    Refused,
    SettingsError,
    StaleResult,
    UnitError,
)
from ._inputs import Mesh, Print, read_mesh, read_print
from ._many import align_many
from ._project import Pair, Project, open
from ._settings import Settings, settings
from ._stages import DepthMap, Surface, depth_map, fit_surface, print_mask

__all__ = [
    "Alignment",
    "BlockAlignment",
    "BlockCharacter",
    "Cancelled",
    "DepthMap",
    "Error",
    "ImageError",
    "InputError",
    "InputNotFound",
    "Mesh",
    "MeshError",
    "MetricResult",
    "NotAProject",
    "Pair",
    "Print",
    "Project",
    "ProjectBusy",
    "ProjectError",
    "ProjectVersionError",
    "ReadOnlyProject",
    "Refusal",
    "Refused",
    "Settings",
    "SettingsError",
    "StaleResult",
    "Surface",
    "UnitError",
    "align",
    "align_block",
    "align_many",
    "depth_map",
    "fit_surface",
    "open",
    "print_mask",
    "read_mesh",
    "read_print",
    "settings",
]

__version__: str = _native.__version__

# The application decides where messages go.
logging.getLogger("mocban").addHandler(logging.NullHandler())

if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_native.forked)
