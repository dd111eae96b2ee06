"""Times whole blocks from files to files: `mocban run` against the steps of `block_assembly.py`.

    cargo build --release
    peers/bin/python benches/peers/block.py

The blocks come from `mocban demo --block`, with their meshes rewritten as binary STL; both programs get the same labels
and give a mesh, a print and a map for each of them. Each program runs in a process of its own, in turn, on all cores.
The time of mocban is that of the four stages of the block, with durable writes; the alignment of each pair, which the
peer does not do, comes in addition. The peer has no catalog, does not sync files, checks nothing and never refuses a
page; its time does not include the imports of Python. A character is right if the root mean square error of its
landmarks on the page is below 5 % of its height, and tight below 1.5 %.
"""

import argparse
import json
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np
import trimesh
from block_assembly import STL, labelled

ROOT = pathlib.Path(__file__).resolve().parents[2]
ASSEMBLY = pathlib.Path(__file__).with_name("block_assembly.py")


def cpu_seconds(pid):
    """Returns the CPU time of a process with all its threads."""
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def measured(command, text="\n", allowed=(0,)):
    """Runs a command, which must end with one of the allowed exit codes; returns its seconds, its peak memory in MB, its
    output, and the CPU seconds that it had used when its messages contained a text."""
    begin, memory, used = time.perf_counter(), 0, None
    with tempfile.TemporaryFile("w+") as output, tempfile.NamedTemporaryFile("w+") as messages:
        with subprocess.Popen(command, stdout=output, stderr=messages) as process:
            while process.poll() is None:
                # `ru_maxrss` would include the memory of this process.
                status = pathlib.Path(f"/proc/{process.pid}/status").read_text().splitlines()
                memory = max([memory, *(int(field.split()[1]) / 1024 for field in status if field.startswith("VmHWM"))])
                if used is None and text in pathlib.Path(messages.name).read_text():
                    used = cpu_seconds(process.pid)
                time.sleep(0.01)
        if process.returncode not in allowed:
            sys.exit(f"{command} failed with {process.returncode}")
        output.seek(0)
        return time.perf_counter() - begin, memory, output.read(), used


def ours(program, work, data):
    """Returns wall-clock and CPU seconds of the stages of the block, peak memory in MB, the maps, and seconds of the
    run with all pairs."""
    project = work / "project"
    shutil.rmtree(project, ignore_errors=True)
    at = [program, "-C", project]
    page = next(data.glob("page.*"))
    labels = ["--labels", data / "labels.json"]
    measured([*at, "import", "--block", data / "block.stl", "--page", page, *labels, "--name", "block"])
    # Exit code 3: some pairs failed. The maps that are compared are those of the block, which failed pairs have, too.
    whole, memory, _, cpu = measured([*at, "run", "--progress", "plain"], "pairs added", (0, 3))
    found = json.loads(measured([*at, "show", "block", "--json"])[2])
    stages = sum(attempt["ms"] for attempt in found["attempts"]) / 1e3
    maps = {one["label"]: one["maps"]["page_from_mesh"] for one in found["character_list"] if one["state"] == "cut"}
    return stages, cpu, memory, maps, whole


def theirs(work, data):
    out = work / "out"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    _, memory, output, _ = measured([sys.executable, ASSEMBLY, data, out])
    seconds, cpu, maps = json.loads(output)
    return seconds, cpu, memory, maps, None


def errors(maps, data):
    """Returns the error of each labelled character as a share of its height; infinite without a map."""
    found, truth = [], json.loads((data / "truth.json").read_text())
    names = {name for _, name in labelled(data)}
    for one in (one for one in truth["characters"] if one["name"] in names):
        left, top, right, bottom = one["box_px"]
        mesh = np.array([[*mark["mesh"], 1] for mark in one["landmarks"]])
        page = np.array([mark["page"] for mark in one["landmarks"]])
        if one["name"] not in maps:
            found.append(np.inf)
            continue
        off = mesh @ np.array(maps[one["name"]])[:2].T - page
        found.append(np.sqrt((off**2).sum(1).mean()) / max(bottom - top, right - left))
    return np.array(found)


def prepared(program, work, kind, seed, spacing):
    """Creates a block of the demo with its mesh as binary STL; returns its folder and its number of triangles."""
    data = work / "demo" / "data"
    if not (data / "block.stl").exists():
        options = [f"--block={kind}", "--seed", str(seed), "--spacing", str(spacing), "--no-run"]
        subprocess.run([program, "demo", work / "demo", *options], check=True, capture_output=True)
        mesh = trimesh.load(data / "block.ply", process=False)
        mesh.export(data / "part.stl")
        (data / "part.stl").rename(data / "block.stl")
    return data, ((data / "block.stl").stat().st_size - 84) // STL.itemsize


def main():
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--blocks", default="plain:0.3,notes:0.3,warp:0.3,plain:0.2", help="kinds and spacings in mm")
    options.add_argument("--seed", type=int, default=11)
    options.add_argument("--rounds", type=int, default=3)
    options.add_argument("--program", type=pathlib.Path, default=ROOT / "target" / "release" / "mocban")
    options.add_argument("--work", type=pathlib.Path, default=ROOT / "target" / "tmp" / "peers-blocks")
    options = options.parse_args()
    print("| block | program | s | CPU s | MB | right | tight | median error | with all pairs, s |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for kind, spacing in (block.split(":") for block in options.blocks.split(",")):
        work = options.work / f"{kind}-{spacing}-{options.seed}"
        data, triangles = prepared(options.program, work, kind, options.seed, spacing)
        spent = {"mocban": [], "assembled": []}
        for _ in range(options.rounds):
            spent["mocban"].append(ours(options.program, work, data))
            spent["assembled"].append(theirs(work, data))
        medians = {name: [statistics.median(run[k] for run in runs) for k in range(3)] for name, runs in spent.items()}
        for name, (seconds, cpu, memory) in medians.items():
            off = errors(spent[name][-1][3], data)
            right, tight = (f"{(off < limit).sum()} of {len(off)}" for limit in (0.05, 0.015))
            cells = [f"{kind}, {triangles / 1e6:.1f} million triangles", name, f"{seconds:.1f}", f"{cpu:.1f}"]
            cells += [f"{memory:.0f}", right, tight, f"{100 * np.median(off):.2f} %"]
            cells += [f"{statistics.median(run[4] for run in spent[name]):.1f}"] if name == "mocban" else [""]
            print(f"| {' | '.join(cells)} |")
        ratios = [f"{a / b:.2f}" for a, b in zip(*medians.values())]
        print(f"| | ratio | {' | '.join(ratios)} | | | | |", flush=True)


if __name__ == "__main__":
    main()
