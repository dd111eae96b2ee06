"""Checks the stroke widths of `examples/measure.py` on bars of known width, at several angles."""

import sys
from pathlib import Path

from common import check
import numpy as np

sys.path.append(str(Path(__file__).parents[2] / "examples"))
from measure import width_px  # noqa: E402

for width in (4, 9, 16):
    for angle in (0, 0.5, np.pi / 4, 2):
        y, x = np.mgrid[-80:81, -80:81]
        across, along = y * np.cos(angle) + x * np.sin(angle), y * np.sin(angle) - x * np.cos(angle)
        found = width_px((np.abs(across + 0.3) < width / 2) & (np.abs(along) < 70))
        check(abs(found / width - 1) < 0.12, f"a bar of {width} px at {angle:.1f} rad has the width {found:.2f} px")
print("examples/measure.py: widths of bars")
