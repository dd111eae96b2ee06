"""Times whole pairs from files to files: `mocban run` against the same steps with Open3D, trimesh and OpenCV.

    cargo build --release
    taskset -c 0 peers/bin/python benches/peers/pair.py

The pairs come from `mocban demo`, with their meshes rewritten as binary STL. Each program runs the whole set in turn, on
one core. The peer does only what the paper requires: plane by RANSAC, depth map by ray casting, ink by Otsu, rotation
by ECC from starting angles all around, thresholds by SSIM and by density over the paper's 90 levels, PNG files. It has
no catalog, does not sync files and checks nothing. It guesses the carved side from the heights, which is wrong for more
than one scan in four; or it aligns both sides and keeps the better one, since neither heights nor winding decide it (of
60 scans, six are wound inside out and six are closed). A result counts as wrong if its rotation is more than 5 degrees
from the truth.
"""

import argparse
import csv
import functools
import json
import os
import pathlib
import shutil
import statistics
import subprocess
import time

import cv2
import numpy as np
import open3d as o3d
import trimesh

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "target" / "release" / "mocban"
LONGEST, CANVAS, SMALL, STARTS = 512, 256, 96, 24
LEVELS = range(50, 140)
OTHER_SIDE = np.diag([1.0, -1.0, -1.0])


def plane(vertices):
    """Returns the rotation that moves the plane with most inliers to z = 0, and the heights over it."""
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(vertices))
    extent = np.ptp(vertices, axis=0).max()
    (a, b, c, _), _ = cloud.segment_plane(extent * 0.002, 3, 100)
    normal = np.array([a, b, c]) / np.linalg.norm([a, b, c])
    along = np.cross([0.0, 1.0, 0.0] if abs(normal[1]) < 0.9 else [1.0, 0.0, 0.0], normal)
    along /= np.linalg.norm(along)
    turn = np.stack([along, np.cross(normal, along), normal])
    heights = vertices @ turn[2]
    low, middle, high = np.quantile(heights, [0.02, 0.5, 0.98])
    return turn if high - middle < middle - low else OTHER_SIDE @ turn


def depth(mesh, turn):
    """Returns the heights as 16 bits, mirrored to read like the print, 0 where no ray hits; and pixels per unit."""
    vertices = (mesh.vertices @ turn.T).astype(np.float32)
    vertices[:, 0] *= -1
    low, high = vertices.min(0), vertices.max(0)
    scale = (LONGEST - 3) / (high - low)[:2].max()
    width, height = (int(np.ceil(side * scale)) + 3 for side in (high - low)[:2])
    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(vertices, mesh.faces.astype(np.uint32))
    x, y = np.meshgrid(low[0] + (np.arange(width) - 1) / scale, high[1] - (np.arange(height) - 1) / scale)
    rays = np.zeros((height, width, 6), np.float32)
    rays[..., 0], rays[..., 1], rays[..., 2], rays[..., 5] = x, y, high[2] + 1, -1
    hit = high[2] + 1 - scene.cast_rays(o3d.core.Tensor(rays), nthreads=1)["t_hit"].numpy()
    seen = np.isfinite(hit)
    span = max(hit[seen].max() - hit[seen].min(), 1e-9)
    return np.where(seen, 1 + (hit - hit[seen].min()) / span * 65534, 0).astype(np.uint16)


def squared(picture, mask, side):
    """Returns the content of a mask's bounding box on a square canvas."""
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    cut = picture[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1].astype(np.float32)
    scale = side * 0.7 / max(cut.shape)
    to = np.float32([[scale, 0, (side - scale * cut.shape[1]) / 2], [0, scale, (side - scale * cut.shape[0]) / 2]])
    return cv2.warpAffine(cut, to, (side, side), flags=cv2.INTER_AREA)


def ecc(fixed, moving, start, steps):
    stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, steps, 1e-5)
    try:
        score, found = cv2.findTransformECC(fixed, moving, start, cv2.MOTION_AFFINE, stop, None, 5)
    except cv2.error:
        return -1.0, start
    return score, found


def register(fixed, moving):
    """Returns the best score and affine map from print to depth on canvases of 256 pixels, over all starting angles."""
    shrink, half = SMALL / CANVAS, np.full(2, 0.5)
    small = [cv2.resize(mask, (SMALL, SMALL), interpolation=cv2.INTER_AREA) for mask in (fixed, moving)]
    middle = (SMALL - 1) / 2
    starts = [cv2.getRotationMatrix2D((middle, middle), k * 360 / STARTS, 1).astype(np.float32) for k in range(STARTS)]
    _, best = max((ecc(*small, start, 20) for start in starts), key=lambda found: found[0])
    turned = best[:, :2] @ half
    best[:, 2] = turned + (best[:, 2] + half - turned) / shrink - half
    return ecc(fixed, moving, best, 30)


def ssim(a, b):
    def mean(picture):
        return cv2.GaussianBlur(picture, (11, 11), 1.5)

    ma, mb = mean(a), mean(b)
    va, vb, vab = mean(a * a) - ma * ma, mean(b * b) - mb * mb, mean(a * b) - ma * mb
    return (((2 * ma * mb + 1e-4) * (2 * vab + 9e-4)) / ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4))).mean()


def side(mesh, turn, fixed):
    """Aligns one side with the print; returns score, rotation, depth map in 16 and 8 bits, its tops, and the map."""
    levels = depth(mesh, turn)
    bytes_ = (levels >> 8).astype(np.uint8)
    top, _ = cv2.threshold(bytes_[levels > 0].reshape(-1, 1), 0, 1, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    tops = bytes_ > top
    score, motion = register(fixed, squared(tops, tops, CANVAS))
    return score, turn, levels, bytes_, tops, motion


def pair(mesh_path, print_path, out, both):
    """Runs all four stages and writes their results as files; returns the print's two axes in the mesh."""
    mesh = trimesh.load(mesh_path, process=False)
    turn = plane(mesh.vertices)
    grey = cv2.imread(str(print_path), cv2.IMREAD_GRAYSCALE)
    _, ink = cv2.threshold(grey, 0, 1, cv2.THRESH_BINARY_INV | cv2.THRESH_OTSU)
    fixed = squared(ink, ink, CANVAS)
    sides = [side(mesh, turn, fixed) for turn in ([turn, OTHER_SIDE @ turn] if both else [turn])]
    _, turn, levels, bytes_, tops, motion = max(sides, key=lambda side: side[0])
    cv2.imwrite(str(out / "depth.png"), levels, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    canvas = squared(bytes_, tops, CANVAS)
    canvas = cv2.warpAffine(canvas, motion, (CANVAS, CANVAS), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
    masks = {level: (canvas > level).astype(np.float32) for level in LEVELS}
    best = {
        "ssim": max(LEVELS, key=lambda level: ssim(fixed, masks[level])),
        "nl_ssim": max(LEVELS, key=lambda level: ssim(fixed - fixed.mean(), masks[level] - masks[level].mean())),
        "density": min(LEVELS, key=lambda level: abs(fixed.mean() - masks[level].mean())),
    }
    scores = {}
    for metric, level in best.items():
        both, either = (fixed * masks[level]).sum(), np.maximum(fixed, masks[level]).sum()
        scores[metric] = {"ssim": float(ssim(fixed, masks[level])), "iou": float(both / max(either, 1))}
        cv2.imwrite(str(out / f"mask.{metric}.png"), (masks[level] * 255).astype(np.uint8))
    cv2.imwrite(str(out / "print_mask.png"), (fixed * 255).astype(np.uint8))
    (out / "pair.json").write_text(json.dumps({"motion": motion.tolist(), "scores": scores}))
    return np.linalg.inv(motion[:, :2]) @ -turn[:2]


def prepared(work, pairs, seed):
    """Creates demo pairs with STL meshes, and their manifest."""
    demo, data = work / "demo", work / "data"
    if data.exists():
        return data
    command = [PROGRAM, "demo", demo, "--tier", "pose", "--pairs", str(pairs), "--seed", str(seed)]
    subprocess.run(command, check=True, capture_output=True)
    half = work / "half"
    half.mkdir(parents=True, exist_ok=True)
    with open(demo / "data" / "manifest.csv", encoding="utf-8") as rows, open(half / "pairs.csv", "w") as out:
        out.write("id,mesh,print\n")
        for row in csv.DictReader(rows):
            mesh = trimesh.load(demo / "data" / row["mesh"], process=False)
            mesh.export(half / f"{row['id']}.stl")
            name = pathlib.Path(row["print"]).name
            shutil.copy(demo / "data" / row["print"], half / name)
            out.write(f"{row['id']},{row['id']}.stl,{name}\n")
    half.rename(data)
    return data


def used():
    """Returns wall-clock time and CPU time of this process and its finished children, seconds."""
    times = os.times()
    return np.array([time.perf_counter(), times.user + times.system + times.children_user + times.children_system])


def ours(work, data):
    """Returns wall-clock and CPU seconds of `run` on a prepared project, and its results."""
    project, out = work / "project", work / "export"
    shutil.rmtree(project, ignore_errors=True)
    subprocess.run([PROGRAM, "-C", project, "import", data / "pairs.csv"], check=True, capture_output=True)
    begin = used()
    subprocess.run([PROGRAM, "-C", project, "run", "--jobs", "1"], capture_output=True)
    spent = used() - begin
    subprocess.run([PROGRAM, "-C", project, "export", "-o", out], check=True, capture_output=True)
    found = [json.loads(line) for line in open(out / "pairs.jsonl", encoding="utf-8")]
    return spent, {
        line["id"]: np.array(line["print_from_mesh"])[:2, :3]
        for line in found
        if line["metric"] == "ensemble" and line["status"] == "done"
    }


def theirs(both, work, data):
    begin, found = used(), {}
    for row in csv.DictReader(open(data / "pairs.csv", encoding="utf-8")):
        folder = work / "out" / row["id"]
        folder.mkdir(parents=True, exist_ok=True)
        found[row["id"]] = pair(data / row["mesh"], data / row["print"], folder, both)
    return used() - begin, found


def wrong(found, work):
    """Returns how many results are missing, mirrored or rotated by more than 5 degrees."""
    count = 0
    for line in open(work / "demo" / "data" / "truth.jsonl", encoding="utf-8"):
        truth = json.loads(line)
        if truth["id"] not in found:
            count += 1
            continue
        axes = np.array(truth["print_from_mesh"])[:2, :3]
        between = found[truth["id"]] @ axes.T
        angle = np.degrees(np.arctan2(between[1, 0] - between[0, 1], between[0, 0] + between[1, 1]))
        count += bool(np.linalg.det(between) <= 0 or abs(angle) > 5)
    return count


def main():
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--pairs", type=int, default=24)
    options.add_argument("--seed", type=int, default=11)
    options.add_argument("--rounds", type=int, default=3)
    options = options.parse_args()
    cv2.setNumThreads(1)
    os.environ["OMP_NUM_THREADS"] = "1"
    work = ROOT / "target" / "tmp" / f"peers-{options.pairs}-{options.seed}"
    data = prepared(work, options.pairs, options.seed)
    everybody = {
        "mocban": ours,
        "assembled, side guessed": functools.partial(theirs, False),
        "assembled, both sides": functools.partial(theirs, True),
    }
    times = {name: [] for name in everybody}
    for _ in range(options.rounds):
        for name, who in everybody.items():
            seconds, found = who(work, data)
            times[name].append((*(seconds / options.pairs * 1e3), wrong(found, work)))
    print("| | ms a pair | ms of a core | wrong | ratio | of core time |\n| --- | --- | --- | --- | --- | --- |")
    medians = {name: [statistics.median(column) for column in zip(*spent)] for name, spent in times.items()}
    for name, (passed, core, missed) in medians.items():
        ratios = " | ".join(f"{ours / its:.3f}" for ours, its in zip(medians["mocban"], (passed, core)))
        print(f"| {name} | {passed:.1f} | {core:.1f} | {missed:.0f} of {options.pairs} | {ratios} |")


if __name__ == "__main__":
    main()
