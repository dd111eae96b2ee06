"""Registers a whole block with its page and cuts the characters, with NumPy, SciPy and OpenCV.

    peers/bin/python benches/peers/block_assembly.py DATA OUT

`DATA` holds `block.stl`, the image of the page and `labels.json`. These are the steps that a researcher would assemble,
vectorized: axes from the distribution of the area, height maps of both sides, strokes above a local surface, ink by a
local threshold, FFT correlation over quarter turns, rotations and scales, affine ECC, three rounds of windows
(`matchTemplate`) with a smooth robust field, one more of the characters themselves, and for each character a mesh
(PLY), a print (PNG) and a map. Prints wall-clock and CPU seconds without the imports, and the maps, as JSON.
"""

import json
import pathlib
import sys
import time

import cv2
import numpy as np
from scipy import fft, interpolate

STL = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("extra", "<u2")])
UNITS_MM = (1.0, 10.0, 25.4, 1000.0)
PIXEL, CELL, NODE, COARSE, AFFINE, MARGIN = 0.2, 4.0, 5.0, 1.2, 0.8, 0.8
NOTHING = np.float32(-1e6)
# Pixel, side, step and reach of windows, and distances over which their shifts are smooth, all in mm.
ROUNDS = ((0.6, 40, 14, 6, 50, 0), (0.4, 26, 9, 2.4, 45, 18), (0.2, 15, 6.5, 1.0, 45, 12))


def axes(corners):
    """Returns the centre, the axes u, v and n of the face as rows, and mm per unit."""
    a, b, c = corners[::16].astype(np.float64).transpose(1, 0, 2)
    normals, middles = np.cross(b - a, c - a), (a + b + c) / 3
    areas = np.linalg.norm(normals, axis=1)
    centre = np.average(middles, axis=0, weights=areas)
    spread, directions = np.linalg.eigh(np.cov((middles - centre).T, aweights=areas))
    n = directions[:, 0]
    for _ in range(4):
        along = normals @ n
        n = (normals * np.sign(along)[:, None])[np.abs(along) > 0.85 * areas].sum(0)
        n /= np.linalg.norm(n)
    u = directions[:, 2] - directions[:, 2] @ n * n
    u /= np.linalg.norm(u)
    long_side = np.sqrt(12 * spread[2])
    return centre, np.stack([u, np.cross(n, u), n]), min(UNITS_MM, key=lambda mm: abs(np.log(long_side * mm / 320)))


def chunks(corners, centre, turn, mm, size=1 << 18):
    """Yields the corners of triangles as u, v and n, mm."""
    for first in range(0, len(corners), size):
        part = corners[first : first + size] - centre.astype(np.float32)
        yield first, part @ (turn.T * mm).astype(np.float32)


def height_maps(corners, centre, turn, mm):
    """Returns the first u and v, and the heights of the front and the back, mm; NaN where there are none."""
    bounds = [(part.min((0, 1)), part.max((0, 1))) for _, part in chunks(corners, centre, turn, mm)]
    low, high = np.min([b[0] for b in bounds], 0) - 1, np.max([b[1] for b in bounds], 0) + 1
    width, height = (np.ceil((high - low)[:2] / PIXEL) + 1).astype(int)
    both = np.full((2, height * width), NOTHING, np.float32)
    for _, part in chunks(corners, centre, turn, mm):
        points = np.concatenate([part, part[:, [1, 2, 0]] * 0.5 + part * 0.5, part.mean(1, keepdims=True)], 1)
        points = points.reshape(-1, 3)
        at = np.rint((points[:, :2] - low[:2]) / PIXEL).astype(np.int32)
        at = at[:, 1] * width + at[:, 0]
        np.maximum.at(both[0], at, points[:, 2])
        np.maximum.at(both[1], at, -points[:, 2])
    sides = []
    for heights in both.reshape(2, height, width):
        # Points are about as dense as pixels; single pixels without one take their neighbours' height.
        filled = cv2.dilate(heights, np.ones((3, 3)), borderType=cv2.BORDER_REPLICATE)
        heights = np.where(heights == NOTHING, filled, heights)
        sides.append(np.where(heights == NOTHING, np.nan, heights))
    # The back has the opposite v axis.
    return [(low[:2], sides[0]), (np.array([low[0], -low[1] - (height - 1) * PIXEL]), sides[1][::-1])]


def relief(heights):
    """Returns the soft strokes of a side, 0..1, where the face is, and the height of the surface under the tops, mm."""
    seen = np.isfinite(heights)
    counts, edges = np.histogram(heights[seen], np.arange(np.nanmin(heights), np.nanmax(heights) + 2, 1.0))
    layer = edges[np.flatnonzero(counts > 0.04 * counts.sum())[-1]]
    face = seen & (heights > layer - 9) & (heights < layer + 3)
    face = cv2.morphologyEx(face.astype(np.uint8), cv2.MORPH_OPEN, np.ones((19, 19))).astype(bool)
    cell = int(CELL / PIXEL)
    rows, columns = (side // cell for side in heights.shape)
    cells = np.where(face, heights, np.nan)[: rows * cell, : columns * cell].reshape(rows, cell, columns, cell)
    cells = cells.transpose(0, 2, 1, 3).reshape(rows, columns, -1)
    few = np.isfinite(cells).mean(2) < 0.3
    cells = np.sort(np.nan_to_num(cells, nan=-1e3), 2)[:, :, -max(1, cell * cell // 20)]
    tops = cv2.dilate(np.where(few, -1e3, cells).astype(np.float32), np.ones((5, 5)))
    known = (tops > -900).astype(np.float32)
    tops = cv2.GaussianBlur(tops * known, (0, 0), 1.0) / np.maximum(cv2.GaussianBlur(known, (0, 0), 1.0), 1e-3)
    tops = cv2.resize(tops, (columns * cell, rows * cell), interpolation=cv2.INTER_CUBIC)
    tops = cv2.copyMakeBorder(
        tops, 0, heights.shape[0] - rows * cell, 0, heights.shape[1] - columns * cell, cv2.BORDER_REPLICATE
    )
    above = np.where(face, heights - tops, -9)
    return (1 / (1 + np.exp(np.clip(-(above + 0.3) / 0.08, -30, 30)))).astype(np.float32), face, tops


def ink(grey):
    """Returns the soft ink of a page, 0..1."""
    small = cv2.resize(grey, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
    sheet = cv2.morphologyEx(small, cv2.MORPH_CLOSE, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (31, 31)))
    sheet = cv2.resize(cv2.GaussianBlur(sheet, (0, 0), 12), grey.shape[::-1])
    dark = np.clip(1 - grey / np.maximum(sheet, 1).astype(np.float32), 0, 1)
    level, _ = cv2.threshold((dark * 255).astype(np.uint8), 0, 1, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    return (1 / (1 + np.exp(-(dark - level / 255) / 0.05))).astype(np.float32)


def shrunk(picture, pixel):
    """Returns means of a picture of the face at another size of pixels, and that size."""
    size = [round(side * PIXEL / pixel) for side in picture.shape[::-1]]
    return cv2.resize(picture, size, interpolation=cv2.INTER_AREA), PIXEL * picture.shape[1] / size[0]


def details(picture):
    return cv2.GaussianBlur(picture, (0, 0), 0.8) - cv2.GaussianBlur(picture, (0, 0), 10)


def extent(picture):
    """Returns the geometric mean of the standard deviations of a distribution along its two axes."""
    y, x = np.mgrid[: picture.shape[0], : picture.shape[1]]
    return np.linalg.det(np.cov(np.stack([x.ravel(), y.ravel()]), aweights=picture.ravel())) ** 0.25


def coarse(soft, page):
    """Returns scores and affine maps from pixels of the relief to the page, both of `COARSE` mm, best first, and page
    pixels per mm."""
    template, pixel = shrunk(soft, COARSE)
    eighth = cv2.resize(page, None, fx=0.125, fy=0.125, interpolation=cv2.INTER_AREA)
    expected = extent(eighth) * 8 / (extent(template) * pixel)
    template = details(template)
    size = fft.next_fast_len(int(1.4 * max(*template.shape, *(side / expected / pixel for side in page.shape))))
    spectrum = np.conj(fft.rfft2(template, (size, size)))
    middle, found = np.array(eighth.shape[::-1]) / 2 - 0.5, []
    for scale in expected * np.linspace(0.88, 1.12, 9):
        for angle in (turn + step for turn in (0, 90, 180, 270) for step in np.arange(-6, 6.1, 1.5)):
            # From pixels of the square to those of the shrunk page.
            rotation = cv2.getRotationMatrix2D((0, 0), -angle, scale * pixel / 8)
            rotation[:, 2] = middle - rotation[:, :2] @ np.full(2, size / 2)
            flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
            moved = details(cv2.warpAffine(eighth, rotation, (size, size), flags=flags))
            score = fft.irfft2(fft.rfft2(moved) * spectrum, (size, size)) / np.linalg.norm(moved)
            best = np.unravel_index(np.argmax(score), score.shape)
            shift = np.array([at - size if at > size * 0.8 else at for at in best[::-1]])
            rotation[:, 2] += rotation[:, :2] @ shift
            found.append((score[best], rotation))
    return sorted(found, key=lambda one: -one[0]), pixel


def affine(soft, page, found, pixel):
    """Refines the best positions by ECC; returns the best correlation and its map from pixels of `PIXEL` mm."""
    template, fine = shrunk(soft, AFFINE)
    template = cv2.GaussianBlur(template, (0, 0), 0.8)
    moving = cv2.resize(page, None, fx=0.125, fy=0.125, interpolation=cv2.INTER_AREA)
    results = []
    for _, start in found[:3]:
        start = start.copy().astype(np.float32)
        start[:, :2] *= fine / pixel
        stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 40, 1e-5)
        try:
            results.append(cv2.findTransformECC(template, moving, start, cv2.MOTION_AFFINE, stop, None, 3))
        except cv2.error:
            continue
    score, best = max(results, key=lambda result: result[0], default=(-1.0, None))
    if best is None:
        return score, None
    # Pixels of different sizes have their middles at half a pixel.
    best = best.astype(np.float64)
    best[:, 2] += best[:, :2] @ np.full(2, 0.5 * PIXEL / fine - 0.5)
    best[:, :2] *= PIXEL / fine
    return score, np.column_stack([best[:, :2] * 8, best[:, 2] * 8 + 3.5])


class PageMap:
    """A smooth map from the face (u, v in mm) to pixels of the page, on nodes every 5 mm."""

    def __init__(self, low, high, page_from_face):
        self.u, self.v = (np.arange(low[k] - 3 * NODE, high[k] + 4 * NODE, NODE) for k in (0, 1))
        self.nodes = np.stack(np.meshgrid(self.u, self.v), -1)
        self.fit(page_from_face(self.nodes.reshape(-1, 2)))

    def fit(self, page):
        page = page.reshape(*self.nodes.shape)
        self.splines = [interpolate.RectBivariateSpline(self.v, self.u, page[..., k], s=0) for k in (0, 1)]

    def at(self, points, du=0, dv=0):
        return np.stack([spline.ev(points[:, 1], points[:, 0], dx=dv, dy=du) for spline in self.splines], -1)

    def slopes(self, points):
        return np.stack([self.at(points, 1, 0), self.at(points, 0, 1)], -1)

    def images(self, u, v):
        return [spline(v, u).astype(np.float32) for spline in self.splines]

    def shift(self, shifts):
        self.fit(self.at(self.nodes.reshape(-1, 2) + shifts))

    def inverse(self, points):
        face = np.tile([self.u.mean(), self.v.mean()], (len(points), 1))
        for _ in range(8):
            face += np.linalg.solve(self.slopes(face), (points - self.at(face))[..., None])[..., 0]
        return face


def smooth(at, shifts, weights, sigma, where):
    """Returns the shifts at places by moving least squares, locally linear."""
    near = weights * np.exp(-0.5 * ((at[None] - where[:, None]) ** 2).sum(2) / sigma**2)
    x, y = at.T / sigma
    sums = near @ np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], -1)
    right = np.stack([near @ (shifts * k[:, None]) for k in (np.ones_like(x), x, y)], 1)
    (s, sx, sy, sxx, sxy, syy), (p, q) = sums.T, where.T / sigma
    lx, ly, ridge = sx - p * s, sy - q * s, 0.05 * s + 1e-6
    lxx, lyy = sxx - 2 * p * sx + p * p * s + ridge, syy - 2 * q * sy + q * q * s + ridge
    lxy = sxy - p * sy - q * sx + p * q * s
    matrix = np.stack([np.stack(row, -1) for row in ((s + 1e-6, lx, ly), (lx, lxx, lxy), (ly, lxy, lyy))], 1)
    local = np.stack([right[:, 0], right[:, 1] - p[:, None] * right[:, 0], right[:, 2] - q[:, None] * right[:, 0]], 1)
    return np.linalg.solve(matrix, local)[:, 0]


def refine(page_map, at, shifts, scores, sigma, fine):
    """Moves the map by a smooth robust field of the windows' shifts."""
    good = scores > 0.35
    at, shifts, weights = at[good], shifts[good], (scores[good] - 0.35) / 0.65
    full = weights
    for _ in range(4):
        residuals = np.linalg.norm(shifts - smooth(at, shifts, weights, sigma, at), axis=1)
        weights = full / (1 + (residuals / max(2.5 * np.median(residuals), 0.06)) ** 2) ** 2
    where = page_map.nodes.reshape(-1, 2)
    field = smooth(at, shifts, weights, sigma, where)
    if fine:
        field += smooth(at, shifts - smooth(at, shifts, weights, sigma, at), weights, fine, where)
    page_map.shift(field)


def match(soft, low, page, page_map, pixel, boxes, reach):
    """Returns the shift of the ink against the relief in boxes on the face, all in mm, and the correlations."""
    template, pixel = shrunk(soft, pixel)
    first = low + (pixel - PIXEL) / 2
    border = int(np.ceil(reach / pixel)) + 1
    u, v = (first[k] + pixel * np.arange(-border, template.shape[1 - k] + border) for k in (0, 1))
    scale = np.sqrt(abs(np.linalg.det(page_map.slopes(np.zeros((1, 2)))[0])))
    blurred = cv2.GaussianBlur(page, (0, 0), 0.35 * scale * pixel)
    warped = cv2.remap(blurred, *page_map.images(u, v), cv2.INTER_LINEAR)
    shifts, scores = np.zeros((len(boxes), 2)), np.full(len(boxes), -1.0)
    limits = np.rint((boxes - np.tile(first, 2)) / pixel).astype(int)
    limits = np.clip(limits, 0, np.tile(template.shape[::-1], 2))
    for k, (left, top, right, bottom) in enumerate(limits):
        part = template[top:bottom, left:right]
        if min(part.shape) < 5 or part.std() < 0.08:
            continue
        area = warped[top : bottom + 2 * border, left : right + 2 * border]
        score = cv2.matchTemplate(area, part, cv2.TM_CCOEFF_NORMED)
        y, x = np.unravel_index(np.argmax(score), score.shape)
        if 0 < x < score.shape[1] - 1 and 0 < y < score.shape[0] - 1:
            sides = ((score[y, x - 1], score[y, x + 1]), (score[y - 1, x], score[y + 1, x]))
            offset = [(b - a) / max(2 * (2 * score[y, x] - a - b), 1e-6) for a, b in sides]
            shifts[k] = (np.array([x, y]) - border + offset) * pixel
            scores[k] = score[y, x]
    return shifts, scores


def register(sides, page, labels):
    """Returns the index of the printed side and the map of its face to the page."""
    coarsest = [coarse(soft, page) for _, soft, _, _ in sides]
    best = [affine(sides[k][1], page, *found) for k, found in enumerate(coarsest)]
    side = max(range(len(sides)), key=lambda k: best[k][0])
    low, soft, face, _ = sides[side]
    rows, columns = np.flatnonzero(face.any(1)), np.flatnonzero(face.any(0))
    ends = [low + PIXEL * np.array([columns[k], rows[k]]) for k in (0, -1)]
    to = best[side][1]
    page_map = PageMap(*ends, lambda face: (face - low) / PIXEL @ to[:, :2].T + to[:, 2])
    for pixel, width, step, reach, sigma, fine in ROUNDS:
        u, v = (np.arange(ends[0][k], ends[1][k] + step / 2, step) for k in (0, 1))
        at = np.stack(np.meshgrid(u, v), -1).reshape(-1, 2)
        boxes = np.concatenate([at - width / 2, at + width / 2], 1)
        boxes = np.clip(boxes, np.tile(ends[0], 2), np.tile(ends[1], 2))
        refine(page_map, at, *match(soft, low, page, page_map, pixel, boxes, reach), sigma, fine)
    boxes = on_face(page_map, labels)
    middles = (boxes[:, :2] + boxes[:, 2:]) / 2
    boxes += [-MARGIN, -MARGIN, MARGIN, MARGIN]
    shifts, scores = match(soft, low, page, page_map, PIXEL, boxes, 1.0)
    refine(page_map, middles, shifts, np.where(scores > 0.6, scores, 0), 30, 9)
    return side, page_map


def on_face(page_map, labels):
    """Returns the bounds on the face of boxes on the page, mm."""
    corners = np.concatenate([labels[:, pair] for pair in ([0, 1], [2, 1], [2, 3], [0, 3])])
    corners = page_map.inverse(corners).reshape(4, -1, 2)
    return np.concatenate([corners.min(0), corners.max(0)], 1)


def cut(corners, frame, side, boxes, page, labels, names, out):
    """Writes mesh and print of each character."""
    (low, _, _, tops), (centre, turn, mm) = side, frame
    places, kept = [], []
    for first, part in chunks(corners, centre, turn, mm):
        middle = part.mean(1)
        at = np.rint((middle[:, :2] - low) / PIXEL).astype(int)
        at = np.clip(at, 0, np.array(tops.shape[::-1]) - 1)
        above = middle[:, 2] - tops[at[:, 1], at[:, 0]]
        near = np.flatnonzero((above > -6) & (above < 2))
        places.append(middle[near, :2])
        kept.append(near + first)
    places, kept = np.concatenate(places), np.concatenate(kept)
    order = np.argsort(places[:, 0], kind="stable")
    places, kept = places[order], kept[order]
    for name, (u0, v0, u1, v1), label in zip(names, boxes, labels):
        first, last = np.searchsorted(places[:, 0], [u0 - MARGIN, u1 + MARGIN])
        v = places[first:last, 1]
        mesh = corners[kept[first:last][(v >= v0 - MARGIN) & (v <= v1 + MARGIN)]]
        soup = np.ascontiguousarray(mesh.reshape(-1, 3))
        _, one, which = np.unique(soup.view("V12").ravel(), return_index=True, return_inverse=True)
        faces = np.empty(len(mesh), [("count", "u1"), ("corners", "<i4", 3)])
        faces["count"], faces["corners"] = 3, which.reshape(-1, 3)
        head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(one)}\nproperty float x\nproperty float y\n"
        head += f"property float z\nelement face {len(mesh)}\nproperty list uchar int vertex_indices\nend_header\n"
        with open(out / f"{name}.ply", "wb") as file:
            file.write(head.encode() + soup[one].tobytes() + faces.tobytes())
        left, top = np.maximum(np.floor(label[:2]).astype(int) - 8, 0)
        right, bottom = np.ceil(label[2:]).astype(int) + 9
        cv2.imwrite(str(out / f"{name}.png"), page[top:bottom, left:right], [cv2.IMWRITE_PNG_COMPRESSION, 1])


def block(data, out):
    """Runs all steps on the files of a block; returns the map from the mesh to the page of each character."""
    corners = np.ascontiguousarray(np.fromfile(data / "block.stl", STL, offset=84)["corners"])
    centre, turn, mm = axes(corners)
    regions = labelled(data)
    labels, names = np.array([box for box, _ in regions]), [name for _, name in regions]
    picture = cv2.imread(str(next(data.glob("page.*"))))
    page = ink(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY))
    sides = [(low, *relief(heights)) for low, heights in height_maps(corners, centre, turn, mm)]
    side, page_map = register(sides, page, labels)
    turn = turn if side == 0 else np.diag([1.0, -1.0, -1.0]) @ turn
    boxes = on_face(page_map, labels)
    cut(corners, (centre, turn, mm), sides[side], boxes, picture, labels, names, out)
    middles = (boxes[:, :2] + boxes[:, 2:]) / 2
    slopes = page_map.slopes(middles)
    linear = slopes @ (turn[:2] * mm)
    shift = page_map.at(middles) - (slopes @ middles[..., None])[..., 0] - linear @ centre
    return {name: np.column_stack([a, b]).tolist() for name, a, b in zip(names, linear, shift)}


def labelled(data):
    """Returns box and name of each label; boxes are in pixels with (0, 0) in the middle of the first one."""
    (entry,) = json.loads((data / "labels.json").read_text())["_via_img_metadata"].values()
    boxes = []
    for region in entry["regions"]:
        shape = region["shape_attributes"]
        x, y = shape["x"] - 0.5, shape["y"] - 0.5
        box = [x, y, x + shape["width"], y + shape["height"]]
        boxes.append((box, region["region_attributes"]["name"]))
    return boxes


def main(data, out):
    begin, used = time.perf_counter(), time.process_time()
    maps = block(data, out)
    print(json.dumps([time.perf_counter() - begin, time.process_time() - used, maps]))


if __name__ == "__main__":
    main(*map(pathlib.Path, sys.argv[1:]))
