#!/usr/bin/env bash
# Compiles what a wheel needs where the distribution has no packages of it: in the containers of
# cibuildwheel (pyproject.toml). Versions are those of Debian 12. Needs curl, a C++ compiler and CMake;
# installs into /usr/local, licences into $LICENCES.
set -euo pipefail
LICENCES=${LICENCES:-/usr/local/share/wheel_licences}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$LICENCES"

# source REPOSITORY TAG: unpacks it into $work/source.
source_of() {
  rm -rf "$work/source" && mkdir "$work/source"
  curl -fsSL "https://github.com/$1/archive/refs/tags/$2.tar.gz" | tar xz -C "$work/source" --strip-components 1
}
# licence NAME ...: the file of the source's licence, for libraries of these names.
licence() {
  local file name
  file=$(find "$work/source" -maxdepth 2 -iname 'LICENSE*' -o -maxdepth 2 -iname 'COPYING*' -o \
    -maxdepth 2 -iname 'BSD-LICENSE' | sort | head -1)
  for name in "$@"; do cp "$file" "$LICENCES/$name.txt"; done
}
# install FOLDER OPTION ...
install() {
  local folder=$1
  shift
  rm -rf "$work/build"
  cmake -S "$work/source/$folder" -B "$work/build" -DCMAKE_BUILD_TYPE=Release -DBUILD_SHARED_LIBS=ON \
    -DCMAKE_INSTALL_PREFIX=/usr/local -DBUILD_TESTING=OFF -DCMAKE_POLICY_VERSION_MINIMUM=3.5 "$@" >/dev/null
  cmake --build "$work/build" --parallel "$(nproc)" --target install >/dev/null
}

source_of eigen-mirror/eigen 3.4.0 && licence eigen && install .
source_of danfis/libccd v2.1 && licence libccd && install . -DENABLE_DOUBLE_PRECISION=ON
source_of OctoMap/octomap v1.9.7 && install octomap -DBUILD_OCTOVIS_SUBPROJECT=OFF
cp "$work/source/octomap/LICENSE.txt" "$LICENCES/liboctomap.txt"
cp "$work/source/octomap/LICENSE.txt" "$LICENCES/liboctomath.txt"
# FCL as Debian has it: without -march=native.
source_of flexible-collision-library/fcl 0.7.0 && licence libfcl && install . -DFCL_USE_X64_SSE=OFF \
  -DFCL_USE_HOST_NATIVE_ARCH=OFF
source_of uxlfoundation/oneTBB v2021.8.0 && licence libtbb && install . -DTBB_TEST=OFF -DTBB_STRICT=OFF
source_of assimp/assimp v5.2.5 && licence libassimp && install . -DASSIMP_BUILD_TESTS=OFF \
  -DASSIMP_WARNINGS_AS_ERRORS=OFF -DASSIMP_BUILD_ZLIB=OFF
source_of nlohmann/json v3.11.2 && licence nlohmann-json && install . -DJSON_BuildTests=OFF
source_of mrdoob/three.js r111 && licence three
mkdir -p /usr/share/javascript/three
cp "$work/source/build/three.min.js" /usr/share/javascript/three/three.min.js
ldconfig
