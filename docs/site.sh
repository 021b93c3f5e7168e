#!/usr/bin/env bash
# Makes the site: guide and reference, C++ and Python, with a search, and recorded runs that play; static
# files in a folder.
#   docs/site.sh [FOLDER]      build/site by default
# Needs doxygen and python3. BUILD_DIR, build/release by default, is a build with examples and the
# Python module: recorded runs and Python's reference are those of that build, and missing without it.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
build=${BUILD_DIR:-$root/build/release}
folder=$(mkdir -p "${1:-$root/build/site}" && cd "${1:-$root/build/site}" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

runs=$folder/runs
mkdir -p "$runs"
record() {  # record NAME PROGRAM ...: the page that the program writes
  if [ -x "$2" ]; then "${@:2}" --page "$runs/$1.html" >/dev/null; fi
}
record helmet "$build/examples/tools/compare_with_fcl"
record clearance "$build/examples/08_clearance"
record gripper "$build/examples/12_gripper"

PYTHONPATH=$build/python /usr/bin/python3 -B "$root/docs/site.py" "$root" "$work" "$runs"
cd "$root"
doxygen - <<END
$(cat docs/Doxyfile)
INPUT = include/adaptive_bvh $work
USE_MDFILE_AS_MAINPAGE = $work/README.md
STRIP_FROM_PATH = . $work
FILE_PATTERNS = *.h *.md *.py
FILTER_PATTERNS =
PYTHON_DOCSTRING = YES
OUTPUT_DIRECTORY = $folder
HTML_OUTPUT = .
HTML_EXTRA_STYLESHEET = docs/site.css
HTML_COLORSTYLE_HUE = 215
HTML_COLORSTYLE_SAT = 60
PROJECT_NUMBER = $(sed -n 's/^project(adaptive_bvh VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
WARN_IF_UNDOCUMENTED = NO
END
echo "$folder/index.html"
