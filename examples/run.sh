#!/usr/bin/env bash
# Sets up everything and runs the main comparison, a helmet that deforms above a plate, or your
# meshes: arguments go to tools/compare_with_fcl (try --help). It also writes the run as a page for
# any browser, and says where.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
build=${BUILD_DIR:-$root/build/release}

"$root/cmake/install_dependencies.sh" g++ make cmake libfcl-dev libccd-dev libeigen3-dev \
  libassimp-dev nlohmann-json3-dev libcli11-dev libtbb-dev libjs-three zlib1g-dev
# A new build folder: without the tests, which would ask for GoogleTest, and a unity build, which
# takes half of the time.
[ -f "$build/CMakeCache.txt" ] || first="-DADAPTIVE_BVH_TESTS=OFF -DCMAKE_UNITY_BUILD=ON"
# shellcheck disable=SC2086
cmake -S "$root" -B "$build" -DCMAKE_BUILD_TYPE=Release -DADAPTIVE_BVH_EXAMPLES=ON ${first:-} >/dev/null
echo "Building (a minute or two the first time) ..."
cmake --build "$build" --parallel "$(nproc)" --target compare_with_fcl >/dev/null
exec "$build/examples/tools/compare_with_fcl" --page "$build/run.html" "$@"
