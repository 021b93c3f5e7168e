#!/usr/bin/env bash
# What differs in the ABI of the shared libraries between two commits, as far as users see it: in
# what public headers declare. Ends with abidiff's status: 0 if nothing does, 4 if something was
# added or changed, 12 if something was removed, so that programs linked to OLD break.
#   test/abidiff.sh OLD [NEW]     (NEW: HEAD)
# Needs git and abidiff (Debian: abigail-tools).
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
old=$(git -C "$root" rev-parse --verify "$1^{commit}")
new=$(git -C "$root" rev-parse --verify "${2:-HEAD}^{commit}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# build COMMIT: its libraries and headers, in a folder named like it. Without optimisation: types and
# functions are the same, and it takes a third of the time.
build() {
  local folder=$work/$1
  mkdir -p "$folder/source"
  git -C "$root" archive "$1" | tar -x -C "$folder/source"
  cmake -S "$folder/source" -B "$folder/build" -DCMAKE_BUILD_TYPE=Debug \
    -DBUILD_SHARED_LIBS=ON -DCMAKE_UNITY_BUILD=ON -DADAPTIVE_BVH_TESTS=OFF -DADAPTIVE_BVH_EXAMPLES=OFF \
    -DADAPTIVE_BVH_BENCHMARKS=OFF -DADAPTIVE_BVH_PYTHON=OFF -DADAPTIVE_BVH_HARDENING=OFF \
    -DCMAKE_INSTALL_PREFIX="$folder/installed" >"$folder/log" 2>&1 &&
    cmake --build "$folder/build" --parallel "$(nproc)" >>"$folder/log" 2>&1 &&
    cmake --install "$folder/build" >>"$folder/log" 2>&1 || { tail -20 "$folder/log" >&2; return 1; }
}
build "$old"
[ "$old" = "$new" ] || build "$new"

worst=0
for library in "$work/$new"/installed/lib*/libadaptive_bvh*.so; do
  name=$(basename "$library")
  before=$(find "$work/$old/installed" -name "$name")
  echo "==== $name"
  [ -n "$before" ] || { echo "new"; continue; }
  status=0
  abidiff --headers-dir1 "$work/$old/installed/include" --headers-dir2 "$work/$new/installed/include" \
    --drop-private-types "$before" "$library" || status=$?
  [ "$status" -le "$worst" ] || worst=$status
done
exit "$worst"
