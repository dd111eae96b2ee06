"""Single stages give what `align` uses."""

from __future__ import annotations

import pickle

import mocban
import numpy as np
import pytest

from conftest import DemoPair


def test_stages_are_those_of_align(pair: DemoPair) -> None:
    mesh, image = mocban.read_mesh(pair.mesh), mocban.read_print(pair.print)
    found = mocban.align(mesh, image)
    surface = mocban.fit_surface(mesh, image)
    depth = mocban.depth_map(mesh, surface)
    np.testing.assert_array_equal(depth.heights, found.depth())
    assert surface.plane_from_mesh.shape == (4, 4) and 0.0 < surface.relief and 0.0 <= surface.side_confidence <= 1.0
    assert depth.levels.dtype == np.uint16 and depth.depth_from_plane.shape == (2, 3)
    assert (mocban.print_mask(image) == found.print_mask()).mean() > 0.99
    for value in (surface, depth):
        copied = pickle.loads(pickle.dumps(value))
        assert copied == value and hash(copied) == hash(value) and repr(copied) == repr(value)
    small = mocban.depth_map(mesh, settings=mocban.settings(depth__longest_px=64))
    assert max(small.levels.shape) == 64
    with pytest.raises(ValueError):
        depth.levels[0, 0] = 1


def test_stages_without_a_result_raise() -> None:
    flat = mocban.Mesh.from_heights(np.zeros((40, 40)), mm_per_px=0.2)
    with pytest.raises(mocban.MeshError, match="the mesh: ") as error:
        mocban.fit_surface(flat)
    assert error.value.code in ("no_solution", "bad_input")
    with pytest.raises(mocban.ImageError, match="no ink to tell from paper") as image_error:
        mocban.print_mask(np.full((90, 90), 255, dtype=np.uint8))
    assert image_error.value.code == "bad_input"
