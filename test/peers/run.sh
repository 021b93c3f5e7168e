#!/usr/bin/env bash
# Measures newer libraries from PyPI beside this one, on the same work.
#   PYTHONPATH=<folder of our module> test/peers/run.sh [--quick] [options of measure.py]
# The environment is build/peers/venv; PYTHON names the interpreter for which our module is built.
# Results: build/peers/peers.csv and a table. A peer that cannot be installed is skipped.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
work=$root/build/peers
mkdir -p "$work"
if [ ! -x "$work/venv/bin/python" ]; then "${PYTHON:-python3}" -m venv "$work/venv"; fi
python=$work/venv/bin/python
# Packages of PYTHONPATH are not those of the environment.
installed=$(PYTHONPATH='' "$python" -m pip freeze --disable-pip-version-check | tr _ -)
while read -r package; do
  case $package in '' | '#'*) continue ;; esac
  if grep -qixF "$package" <<<"$installed"; then continue; fi
  PYTHONPATH='' "$python" -m pip install --quiet --disable-pip-version-check "$package" ||
    echo "skipped: $package cannot be installed" >&2
done <"$here/requirements.txt"
"$python" "$here/measure.py" --csv "$work/peers.csv" "$@"
