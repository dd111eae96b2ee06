"""Opens the images of `fiji` in tifffile, Pillow and OpenCV: calibration, channels, heights, mask and labels."""

from common import apply, check, check_labels, check_landmarks, folders, mm_per_mesh_unit, read_lines, single_results, source
import cv2
import numpy as np
import tifffile
from PIL import Image
from prints import print_rgb


def read(path, unit, size):
    """Returns the pixels and the metadata of a TIFF of ImageJ with a given pixel size."""
    with tifffile.TiffFile(path) as file:
        check(file.is_imagej, f"{path} is not recognized as an image of ImageJ")
        check(file.imagej_metadata["unit"] == unit, f"{path} is in {file.imagej_metadata['unit']}, not {unit}")
        for tag in ("XResolution", "YResolution"):
            px, units = file.pages[0].tags[tag].value
            check(abs(units / px / size - 1) < 1e-5, f"{path}: {tag} is {units / px} {unit} per px, not {size}")
        return file.asarray(), file.imagej_metadata


def same_in_others(path, expected):
    """Checks that Pillow and OpenCV read the pixels that tifffile reads."""
    others = {"Pillow": np.asarray(Image.open(path)), "OpenCV": cv2.imread(str(path), cv2.IMREAD_UNCHANGED)}
    for name, found in others.items():
        check(np.array_equal(found, expected, equal_nan=True), f"{path} differs between {name} and tifffile")


export, data = folders()
depths = {line["id"]: line["files"]["depth"] for line in read_lines(export / "jsonl" / "pairs.jsonl")}
lines = single_results(export, "fiji").values()
for line in lines:
    name, mm = line["id"], mm_per_mesh_unit(line)
    folder = (export / "fiji" / line["files"]["heights"]).parent
    unit, size = "mm" if line["mm_per_mesh_unit"] else "mesh unit", line["mesh_unit_per_px"] * mm
    heights, _ = read(folder / "heights.tif", unit, size)
    levels = np.asarray(Image.open(export / "jsonl" / depths[name])).astype(float)
    expected = (line["height_min"] + (levels - 1) * line["height_per_level"]) * mm
    expected[levels == 0] = np.nan
    # 32-bit floats have seven digits.
    same = np.allclose(heights, expected, rtol=1e-6, atol=1e-6, equal_nan=True)
    check(same, f"{name}: the heights are not those of the depth map")
    same_in_others(folder / "heights.tif", heights)
    strokes, _ = read(folder / "strokes.tif", unit, size / line["scale"])
    same_in_others(folder / "strokes.tif", strokes)
    stack, metadata = read(folder / "stack.tif", unit, size / line["scale"])
    check(metadata["Labels"] == ["print", "height", "mask"], f"{name}: the channels are {metadata['Labels']}")
    picture = print_rgb(source(data, "prints", name))
    check(stack.shape == (3, *picture.shape[:2]), f"{name}: the stack has the shape {stack.shape}")
    off = np.abs(stack[0] - picture @ np.array([0.299, 0.587, 0.114])).mean()
    check(off < 1, f"{name}: the first channel is {off} levels from the print")
    mask = stack[2] == 255
    check(((stack[2] == 0) | mask).all(), f"{name}: the mask has other values than 0 and 255")
    check(np.array_equal(strokes > 0, mask), f"{name}: the labels and the mask differ")
    check(np.unique(strokes[mask]).size == strokes.max(), f"{name}: a number of a stroke is missing")
    known = np.isfinite(stack[1])
    agree = ((stack[1] >= line["threshold_depth"] * mm) == mask)[known].mean()
    check(agree > 0.97, f"{name}: mask and heights agree at only {agree:.1%} of the pixels")
check_labels("fiji", lines, data)
check_landmarks("fiji", data, lines)
