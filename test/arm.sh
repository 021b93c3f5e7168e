#!/usr/bin/env bash
# Cross-builds the library and its fast tests for 64-bit ARM, and runs them under qemu-user. Needs
# Debian 12 and root, and up to an hour on two cores. Not part of CI.
#   test/arm.sh [PROGRAM ...]    which test programs: those below, or these
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
build=$root/build/arm
sysroot=$build/sysroot
programs=("$@")
[ $# -gt 0 ] || programs=(core_tests query_tests model_tests)

"$root/cmake/install_dependencies.sh" g++-aarch64-linux-gnu qemu-user mmdebstrap cmake ninja-build
mkdir -p "$build"
# Debian's libraries for ARM in a folder: the machine's own packages stay as they are.
if [ ! -d "$sysroot/usr/include/fcl" ]; then
  rm -rf "$sysroot"
  mmdebstrap --quiet --arch=arm64 --variant=extract \
    --include=libc6-dev,libstdc++-12-dev,libfcl-dev,libccd-dev,libeigen3-dev,libgtest-dev,libtbb-dev \
    bookworm "$sysroot"
  # libccd's package names a file of the machine that it was built on.
  sed -i 's|/usr/lib/aarch64-linux-gnu/libm.so|m|g' \
    "$sysroot"/usr/lib/aarch64-linux-gnu/ccd/ccd-targets*.cmake
fi
cat >"$build/toolchain.cmake" <<EOF
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_SYSROOT $sysroot)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_CROSSCOMPILING_EMULATOR "qemu-aarch64;-L;$sysroot")
EOF
cmake -S "$root" -B "$build" -G Ninja -DCMAKE_TOOLCHAIN_FILE="$build/toolchain.cmake" \
  -DCMAKE_BUILD_TYPE=Release -DCMAKE_UNITY_BUILD=ON -DADAPTIVE_BVH_WARNINGS_AS_ERRORS=ON \
  -DADAPTIVE_BVH_OBBRSS_TESTS=OFF -DADAPTIVE_BVH_BENCHMARKS=OFF -DADAPTIVE_BVH_EXAMPLES=OFF \
  -DADAPTIVE_BVH_PYTHON=OFF -DADAPTIVE_BVH_MESH_IO=OFF -DADAPTIVE_BVH_POLICY_JSON=OFF \
  -DADAPTIVE_BVH_RECORDING=OFF -DADAPTIVE_BVH_TUNING=OFF >/dev/null
cmake --build "$build" --target adaptive_bvh "${programs[@]}"

# An emulated processor is slow: what tries one thing often is left out.
slow='*Soak*:*Exactness*:Coherent*:*Broadphase*:Proximity*:*GroundTruth*:Octree*:ShapeDistance*'
slow+=':FclConsumers*:NearestPoints*:LatticeDistance*:PartialUpdate/*:DropIn*'
slow+=':Containment.*:*Criteria*:Scenarios*'
failed=0
for program in "${programs[@]}"; do
  echo "== $program, aarch64"
  qemu-aarch64 -L "$sysroot" "$build/test/$program" --gtest_brief=1 \
    --gtest_filter="${GTEST_FILTER:--$slow}" || failed=1
done
exit $failed
