"""Names each reader that is not installed and whose tests are therefore skipped, one line each."""

from importlib import import_module
from pathlib import Path
from shutil import which

# Modules of packages whose names differ.
MODULES = {"open3d-cpu": "open3d", "opencv-python-headless": "cv2", "pillow": "PIL"}
JAR = "/usr/share/java/ij.jar"

for requirement in Path(__file__).with_name("requirements.txt").read_text().split():
    package = requirement.split("==")[0]
    try:
        import_module(MODULES.get(package, package))
    except ImportError as error:
        print(f"skipped: {package} cannot be used ({error}); its tests do not run")
for program in ("CloudCompare", "xvfb-run", "node"):
    if which(program) is None:
        print(f"skipped: {program} is not installed; its tests do not run")
if which("java") is None or not Path(JAR).exists():
    print(f"skipped: ImageJ ({JAR}) is not installed; its test does not run")
