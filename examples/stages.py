"""Draws the stages of one pair with a label under each panel, such as docs/pictures/stages.png in the README:

    mocban demo demo --tier pose --pairs 4 --seed 1
    mocban -C demo export -o demo-export
    pip install pillow numpy
    python examples/stages.py demo-export pose-0003 docs/pictures/stages.png
"""

import json
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

PANEL_PX = 260
GAP_PX = 16
LABEL_PX = 84
# Large enough to be read when a page shows the picture 800 pixels wide.
FONT = ImageFont.load_default(32)
SMALL_FONT = ImageFont.load_default(23)
METRIC = "ensemble"


def shaded_relief(export: Path, line: dict) -> Image.Image:
    """Returns the depth map lit from the top left; pixels without data are white."""
    levels = np.asarray(Image.open(export / line["files"]["depth"])).astype(float)
    height_px = levels * line["height_per_level"] / line["mesh_unit_per_px"]
    dy, dx = np.gradient(height_px)
    normal = np.stack([-dx, -dy, np.ones_like(dx)]) / np.sqrt(dx**2 + dy**2 + 1)
    light = np.array([-0.5, -0.6, 0.62])
    shade = np.clip(np.tensordot(light, normal, 1), 0, 1) ** 0.8
    rgb = 40 + shade[..., None] * np.array([206, 190, 160])
    rgb[levels == 0] = 255
    return Image.fromarray(rgb.astype(np.uint8))


def panels(export: Path, line: dict) -> list[tuple[Image.Image, str, str]]:
    """Returns the panels, each with its title and a second line."""
    files = {name: export / path for name, path in line["files"].items()}
    return [
        (Image.open(files["print"]), "1  Print", "as scanned"),
        (shaded_relief(export, line), "2  Depth map", "mirrored, on the plane"),
        (Image.open(files["depth_mask"]), "3  Relief mask", "above the threshold"),
        (Image.open(files["aligned_mask"]), "4  Aligned mask", "in the print's frame"),
        (Image.open(files["overlay"]), "5  Overlay", "outline on the print"),
    ]


def main(export: str, pair: str, output: str) -> None:
    """Writes the picture of a pair of an export of the format `jsonl`."""
    lines = map(json.loads, open(Path(export) / "pairs.jsonl", encoding="utf-8"))
    line = next((line for line in lines if (line["id"], line["metric"]) == (pair, METRIC)), None)
    if line is None:
        sys.exit(f"{export} has no result of the pair {pair} with the metric {METRIC}")
    drawn = panels(Path(export), line)
    width = len(drawn) * (PANEL_PX + GAP_PX) + GAP_PX
    sheet = Image.new("RGB", (width, PANEL_PX + LABEL_PX + 2 * GAP_PX), "white")
    draw = ImageDraw.Draw(sheet)
    for index, (panel, title, text) in enumerate(drawn):
        panel = panel.convert("RGB")
        factor = PANEL_PX / max(panel.size)
        panel = panel.resize([round(side * factor) for side in panel.size], Image.Resampling.LANCZOS)
        left = GAP_PX + index * (PANEL_PX + GAP_PX)
        sheet.paste(panel, (left + (PANEL_PX - panel.width) // 2, GAP_PX + (PANEL_PX - panel.height) // 2))
        middle = left + PANEL_PX // 2
        draw.text((middle, GAP_PX + PANEL_PX + 8), title, "black", FONT, anchor="mt")
        draw.text((middle, GAP_PX + PANEL_PX + 50), text, "#444444", SMALL_FONT, anchor="mt")
    sheet.convert("P", palette=Image.Palette.ADAPTIVE, colors=128).save(output, optimize=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
