"""Times the same work on the same files in mocban and in other tools, and prints the ratios.

    python3 -m venv peers && peers/bin/pip install -r benches/peers/requirements.txt
    taskset -c 0 peers/bin/python benches/peers/compare.py

Open3D needs the system's libusb-1.0 and libGL (Debian: libusb-1.0-0, libgl1, libgomp1).

Measurements of both alternate, so that other load on the machine affects both alike. `taskset` limits both to one
core. The files come from `cargo bench --bench speed`, which generates them in the first round.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import time

import cv2
import numpy as np
import open3d as o3d
import SimpleITK as sitk
import trimesh
from skimage.metrics import structural_similarity

ROOT = pathlib.Path(__file__).resolve().parents[2]
FILES = ROOT / "target" / "tmp" / "speed"
CRITERION = ROOT / "target" / "criterion"
CANVAS = (256, 512, 1024)


def rust(bench):
    """Median milliseconds of one benchmark of `cargo bench --bench speed`."""
    command = ["cargo", "bench", "--quiet", "--bench", "speed", "--", f"^{bench}$"]
    subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    group, size = bench.rsplit("/", 1)
    path = CRITERION / group.replace("/", "_") / size / "new" / "estimates.json"
    return json.loads(path.read_text())["median"]["point_estimate"] / 1e6


def timed(work, least=3, seconds=1.5):
    """Median milliseconds of some work."""
    times, until = [], time.perf_counter() + seconds
    while len(times) < least or (time.perf_counter() < until and len(times) < 50):
        begin = time.perf_counter()
        work()
        times.append((time.perf_counter() - begin) * 1e3)
    return statistics.median(times)


def rings(side, moved):
    """The masks of `benches/speed/scores.rs`: rings about as wide as strokes."""
    width, middle = side / 14, side / 2
    y, x = np.mgrid[:side, :side]
    radius = np.hypot(x - middle - moved * width, y - middle)
    return ((radius / width).astype(int) % 2 == 0).astype(np.float64)


def readers(size):
    for ending in ("obj", "ply", "stl"):
        path = str(FILES / size / f"scan.{ending}")
        yield f"read/{ending}/{size}", "Open3D", lambda p=path: o3d.io.read_triangle_mesh(p)
        yield f"read/{ending}/{size}", "trimesh", lambda p=path: trimesh.load(p, process=False)
        if ending == "obj":
            yield f"read/{ending}/{size}", "tobj", f"read/tobj_obj/{size}"
        yield f"read/{ending}/{size}", "its bytes", lambda p=path: pathlib.Path(p).read_bytes()


def stages(size):
    def mesh():
        return o3d.io.read_triangle_mesh(str(FILES / size / "scan.ply"))

    held = mesh()
    cloud = o3d.geometry.PointCloud(held.vertices)
    yield f"stages/fit/{size}", "Open3D segment_plane(100)", lambda: cloud.segment_plane(
        held.get_max_bound().max() * 0.002, 3, 100
    )
    low, high = held.get_min_bound(), held.get_max_bound()
    tensor = o3d.t.geometry.TriangleMesh.from_legacy(held)

    def cast(side=1024):
        scene = o3d.t.geometry.RaycastingScene(nthreads=1)
        scene.add_triangles(tensor)
        x, y = np.meshgrid(np.linspace(low[0], high[0], side), np.linspace(low[1], high[1], side))
        rays = np.zeros((side, side, 6), np.float32)
        rays[..., 0], rays[..., 1], rays[..., 2], rays[..., 5] = x, y, high[2] + 1, -1
        return scene.cast_rays(o3d.core.Tensor(rays), nthreads=1)

    yield f"stages/depth_1024/{size}", "Open3D build and cast 1024 x 1024", cast


def scores():
    for side in CANVAS:
        one, two = rings(side, 0.0), rings(side, 0.4)
        yield f"scores/{side}", "scikit-image SSIM", lambda a=one, b=two: structural_similarity(
            a, b, data_range=1.0, gaussian_weights=True, use_sample_covariance=False
        )
        heights = np.fromfunction(
            lambda y, x: 32768 + 20000 * np.sin(x * 0.05) * np.cos(y * 0.07) + (x * 7 + y * 13) % 40, (side, side)
        ).astype(np.uint16)
        yield f"png_grey16/{side}", "OpenCV", lambda h=heights: cv2.imencode(".png", h)


def registration(side, size):
    """Registration of two masks of `side` pixels that are 3 degrees apart, against the whole register stage, which
    searches all rotations, both readings and a range of scales, chooses thresholds and scores them."""
    print_mask = rings(side, 0.0).astype(np.float32)
    turn = cv2.getRotationMatrix2D((side / 2, side / 2), 3.0, 1.03)
    depth_mask = cv2.warpAffine(print_mask, turn, (side, side))

    def ecc():
        stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 50, 1e-6)
        cv2.findTransformECC(print_mask, depth_mask, np.eye(2, 3, dtype=np.float32), cv2.MOTION_AFFINE, stop, None, 5)

    def itk():
        method = sitk.ImageRegistrationMethod()
        method.SetMetricAsMeanSquares()
        method.SetOptimizerAsRegularStepGradientDescent(1.0, 1e-4, 100)
        method.SetInitialTransform(sitk.Similarity2DTransform())
        method.SetInterpolator(sitk.sitkLinear)
        method.SetGlobalDefaultNumberOfThreads(1)
        method.Execute(sitk.GetImageFromArray(print_mask), sitk.GetImageFromArray(depth_mask))

    yield f"stages/register/{size}", f"OpenCV ECC, {side} px, started 3 degrees off", ecc
    yield f"stages/register/{size}", f"SimpleITK, {side} px, started 3 degrees off", itk


def main():
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--sizes", default="60k,500k")
    options.add_argument("--rounds", type=int, default=3)
    options.add_argument("--only", default="", help="benchmarks whose name holds this")
    options = options.parse_args()
    cv2.setNumThreads(1)
    sizes = options.sizes.split(",")
    for size in sizes:
        rust(f"read/raw_stl/{size}")
    cases = [case for size in sizes for make in (readers, stages) for case in make(size)]
    cases += [*scores(), *registration(256, sizes[0]), *registration(512, sizes[0])]
    cases = [case for case in cases if options.only in case[0]]
    times = {}
    for _ in range(options.rounds):
        for bench, peer, work in cases:
            ours = times.setdefault((bench, "mocban"), [])
            # Several peers share one measurement of mocban per round.
            if len(ours) <= len(times.get((bench, peer), [])):
                ours.append(rust(bench))
            times.setdefault((bench, peer), []).append(rust(work) if isinstance(work, str) else timed(work))
    print("| benchmark | mocban, ms | peer | its ms | ratio |\n| --- | --- | --- | --- | --- |")
    for bench, peer, _ in cases:
        ours, theirs = (statistics.median(times[bench, who]) for who in ("mocban", peer))
        print(f"| {bench} | {ours:.2f} | {peer} | {theirs:.2f} | {ours / theirs:.3f} |")


if __name__ == "__main__":
    main()
