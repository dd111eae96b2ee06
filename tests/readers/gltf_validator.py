"""Runs the glTF validator of Khronos on each `scan.glb`. `GLTF_VALIDATOR` is the folder in which npm installed it."""

import os
import subprocess

from common import check, folders, program, skip
from scans import scans

SCRIPT = """
const validator = require('gltf-validator'), fs = require('fs');
(async () => {
    for (const path of process.argv.slice(1)) {
        const { issues, info } = await validator.validateBytes(new Uint8Array(fs.readFileSync(path)));
        console.log(path, issues.numErrors, issues.numWarnings, info.totalVertexCount, JSON.stringify(issues.messages[0]));
    }
})();
"""

export, _ = folders()
folder = os.environ.get("GLTF_VALIDATOR") or skip("GLTF_VALIDATOR names no folder with the package gltf-validator")
paths = [str((scan / "scan.glb").resolve()) for _, scan in scans(export)]
done = subprocess.run([program("node"), "-e", SCRIPT, *paths], cwd=folder, capture_output=True, text=True)
check(done.returncode == 0, f"the glTF validator ends with {' '.join(done.stderr[-300:].split())}")
rows = done.stdout.splitlines()
check(len(rows) == len(paths), f"the glTF validator checked {len(rows)} of {len(paths)} files")
for row in rows:
    path, errors, warnings, vertices, message = row.split(" ", 4)
    check(errors == warnings == "0", f"{path}: {errors} errors and {warnings} warnings, such as {message}")
    check(int(vertices) > 1000, f"{path} has {vertices} vertices")
print(f"glTF validator: {len(rows)} files without errors and warnings")
