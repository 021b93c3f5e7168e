"""Puts the shared libraries that a wheel needs into it, with their licences.

    python python/repair_wheel.py WHEEL FOLDER

Needs auditwheel and patchelf. FOLDER gets the wheel, whose tag says the oldest glibc that it works
with: manylinux_2_35 from Debian 12. Licences are those of Debian's packages, or the files
LICENCES/<name of the library>.txt where the environment variable LICENCES names a folder.
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile

from auditwheel.wheeltools import InWheel

# What is compiled into the module, by Debian's names: headers, and the viewer of recorded pages.
COMPILED_IN = {"eigen": "libeigen3-dev", "nlohmann-json": "nlohmann-json3-dev", "three": "libjs-three"}


def folders_of_libraries():
    listed = subprocess.run(["ldconfig", "-p"], capture_output=True, text=True, check=True).stdout
    paths = [line.split("=> ")[1] for line in listed.splitlines() if "=> " in line]
    more = os.environ.get("LD_LIBRARY_PATH", "").split(":")
    return {os.path.dirname(os.path.realpath(path)) for path in paths} | set(filter(None, more))


def package_of(library):
    for folder in folders_of_libraries():
        path = os.path.join(folder, library)
        if os.path.exists(path):
            owner = subprocess.run(["dpkg", "-S", path], capture_output=True, text=True, check=False)
            if owner.returncode == 0:
                return owner.stdout.split(":")[0]
    sys.exit(f"{library}: no package has it, and LICENCES has no file for it")


def licence_of(name, package):
    """The text for a library or package."""
    given = pathlib.Path(os.environ.get("LICENCES", "/nowhere"), f"{name}.txt")
    if given.exists():
        return given.read_text()
    text = pathlib.Path("/usr/share/doc", package(), "copyright").read_text(errors="replace")
    # Debian's texts refer to licences that every Debian has.
    for common in sorted(set(re.findall(r"/usr/share/common-licenses/[\w.-]*\w", text))):
        if os.path.exists(common):
            text += f"\n\n{common}:\n\n{pathlib.Path(common).read_text()}"
    return text


def add_licences(wheel, to):
    with InWheel(wheel, to / wheel.name) as root:
        root = pathlib.Path(root)
        (info,) = root.glob("*.dist-info")
        folder = info / "licenses"
        folder.mkdir(exist_ok=True)
        for library in sorted((root / "adaptive_bvh.libs").iterdir()):
            name, ending = re.fullmatch(r"(.+?)-[0-9a-f]{8}(\.so.*)", library.name).groups()
            text = licence_of(name, lambda: package_of(name + ending))
            (folder / f"{name}.txt").write_text(text)
        for name, package in COMPILED_IN.items():
            (folder / f"{name}.txt").write_text(licence_of(name, lambda: package))


def main():
    wheel, to = map(pathlib.Path, sys.argv[1:])
    to.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work:
        command = [sys.executable, "-m", "auditwheel", "repair", wheel, "-w", work]
        subprocess.run(command, check=True)
        (repaired,) = pathlib.Path(work).glob("*.whl")
        add_licences(repaired, to)
    size = (to / repaired.name).stat().st_size
    print(f"{to / repaired.name}: {size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
