#!/usr/bin/env bash
# Sets up everything, builds, and runs the tests of the library; arguments go to ctest (try -R
# Exactness). CI adds those of documents, recorded pages and packages, and repeats some with
# further types, by ADAPTIVE_BVH_PACKAGE_TESTS.
#   CMAKE_ARGS                  further settings for cmake
#   ADAPTIVE_BVH_LONG_TESTS=1   the longer mode: tests with random numbers take other ones each time,
#                               say from which seed, and many of them try ten times as many
#   ADAPTIVE_BVH_TEST_SEED=n    the numbers of that seed again
# Both variables work with a single test program, too, and with pytest.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
build=${BUILD_DIR:-$root/build/release}

"$root/cmake/install_dependencies.sh" g++ make cmake libfcl-dev libccd-dev libeigen3-dev \
  libassimp-dev libcli11-dev libgtest-dev libpagmo-dev nlohmann-json3-dev libbenchmark-dev \
  libtbb-dev libjs-three pybind11-dev python3-dev python3-numpy python3-pytest python3-hypothesis \
  zlib1g-dev
# A new build folder: a unity build, which takes half of the time, without the examples. For work on
# the library make one by a preset.
[ -f "$build/CMakeCache.txt" ] || first="-DCMAKE_UNITY_BUILD=ON -DADAPTIVE_BVH_EXAMPLES=OFF"
cmake -S "$root" -B "$build" -DCMAKE_BUILD_TYPE=Release -DADAPTIVE_BVH_TESTS=ON \
  ${first:-} ${CMAKE_ARGS:-} >/dev/null
cmake --build "$build" --parallel "$(nproc)"
cd "$build"
exec ctest --output-on-failure --parallel "$(nproc)" "$@"
