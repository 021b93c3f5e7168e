"""Makes a wheel of a checkout with CMake (PEP 517): `pip wheel . --no-deps` calls build_wheel.

Needs what the library needs and pybind11, and of Python nothing but pip. The environment variable
CMAKE_ARGS may hold options of CMake.
"""

import base64
import hashlib
import os
import pathlib
import re
import shlex
import subprocess
import sys
import sysconfig
import tempfile
import zipfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
SUMMARY = "Exact distance and collision queries on deforming triangle meshes"


def version():
    text = (ROOT / "CMakeLists.txt").read_text()
    return re.search(r"project\(adaptive_bvh VERSION ([0-9.]+)", text).group(1)


def metadata():
    return f"""Metadata-Version: 2.1
Name: adaptive_bvh
Version: {version()}
Summary: {SUMMARY}
License: BSD-3-Clause
Classifier: License :: OSI Approved :: BSD License
Classifier: Programming Language :: C++
Classifier: Programming Language :: Python :: 3
Requires-Python: >=3.9
Requires-Dist: numpy
Provides-Extra: study
Requires-Dist: distributed; extra == "study"
Description-Content-Type: text/markdown

{(ROOT / "README.md").read_text()}"""


def install_into(prefix):
    """Configures, builds and installs the package, as prefix/adaptive_bvh."""
    build = ROOT / "build" / "wheel"
    options = {
        "CMAKE_BUILD_TYPE": "Release",
        "Python3_EXECUTABLE": sys.executable,
        "ADAPTIVE_BVH_PYTHON": "ON",
        "ADAPTIVE_BVH_PYTHON_DIR": ".",
        "ADAPTIVE_BVH_TESTS": "OFF",
        "ADAPTIVE_BVH_EXAMPLES": "OFF",
        "ADAPTIVE_BVH_TUNING": "OFF",
    }
    more = shlex.split(os.environ.get("CMAKE_ARGS", ""))
    jobs = os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL", str(os.cpu_count()))
    for command in (
        ["cmake", "-S", ROOT, "-B", build, *(f"-D{k}={v}" for k, v in options.items()), *more],
        ["cmake", "--build", build, "--target", "adaptive_bvh_python", "--parallel", jobs],
        ["cmake", "--install", build, "--component", "python", "--prefix", prefix],
    ):
        subprocess.run(command, check=True)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Writes the wheel; returns its name."""
    python = "cp{}{}".format(*sys.version_info)
    platform = re.sub("[-.]", "_", sysconfig.get_platform())
    tag = f"{python}-{python}-{platform}"
    info = f"adaptive_bvh-{version()}.dist-info/"
    files = {
        info + "METADATA": metadata().encode(),
        info + "WHEEL": f"Wheel-Version: 1.0\nGenerator: adaptive_bvh\nRoot-Is-Purelib: false\n"
        f"Tag: {tag}\n".encode(),
        info + "entry_points.txt": b"[console_scripts]\nadaptive_bvh = adaptive_bvh._clearance:main\n",
        info + "licenses/LICENSE": (ROOT / "LICENSE").read_bytes(),
    }
    with tempfile.TemporaryDirectory() as prefix:
        install_into(prefix)
        for path in sorted(pathlib.Path(prefix, "adaptive_bvh").rglob("*")):
            if path.is_file():
                files[path.relative_to(prefix).as_posix()] = path.read_bytes()
    record = ""
    for name, data in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        record += f"{name},sha256={digest},{len(data)}\n"
    files[info + "RECORD"] = f"{record}{info}RECORD,,\n".encode()
    wheel = f"adaptive_bvh-{version()}-{tag}.whl"
    with zipfile.ZipFile(os.path.join(wheel_directory, wheel), "w", zipfile.ZIP_DEFLATED) as out:
        for name, data in files.items():
            out.writestr(name, data)
    return wheel


class UnsupportedOperation(Exception):
    """The name that PEP 517 gives to it."""


def build_sdist(sdist_directory, config_settings=None):
    raise UnsupportedOperation("sources are distributed as a git repository")
