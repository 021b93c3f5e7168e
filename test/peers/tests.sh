#!/usr/bin/env bash
# Tests what plugs into other libraries, with those that can be installed.
#   PYTHONPATH=<folder of our module> test/peers/tests.sh [PACKAGE ...]
# The environment is that of run.sh. Without names: all packages that the tests use (newton and mujoco
# are large); torch is used where it is installed. trimesh's own tests come from its source
# distribution. Folders of data: IPCTK_DATA and TRIMESH_MODELS, see tests/conftest.py.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
work=$here/../../build/peers
mkdir -p "$work"
if [ ! -x "$work/venv/bin/python" ]; then "${PYTHON:-python3}" -m venv "$work/venv"; fi
python=$work/venv/bin/python
[ $# -gt 0 ] || set -- numpy scipy trimesh python-fcl ipctk warp-lang mujoco newton vtk pyvista
for package in "$@" pytest; do
  # Those of requirements.txt have their versions there.
  pinned=$(grep -x "$package==.*" "$here/requirements.txt" || echo "$package")
  PYTHONPATH='' "$python" -m pip install --quiet --disable-pip-version-check "$pinned" ||
    echo "skipped: $package cannot be installed" >&2
done
if [ ! -e "$work/trimesh/test_collision.py" ]; then
  version=$(PYTHONPATH='' "$python" -m pip show trimesh 2>/dev/null | sed -n 's/^Version: //p')
  PYTHONPATH='' "$python" -m pip download --quiet --disable-pip-version-check --no-deps \
    --no-binary trimesh --dest "$work/trimesh" "trimesh==$version" &&
    tar xzf "$work"/trimesh/*.tar.gz -C "$work/trimesh" --strip-components 2 \
      "trimesh-$version/tests/test_collision.py" || echo "skipped: trimesh's own tests" >&2
fi
export TRIMESH_TESTS=$work/trimesh/test_collision.py
"$python" -B -m pytest -q -rs -p no:cacheprovider "$here/tests"
