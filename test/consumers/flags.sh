#!/usr/bin/env bash
# Users' compiler flags with an installed library:
#   flags.sh PREFIX WORK    an installation, and a folder for the programs
# flags.cpp is compiled with each set of flags below; all programs must find the same bits. Flags that
# cannot work are refused in one sentence, and the library shares no function of Eigen with programs.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
prefix=$1 work=$2
mkdir -p "$work"
PKG_CONFIG_PATH=$(dirname "$(find "$prefix" -name adaptive_bvh.pc)")
export PKG_CONFIG_PATH
read -ra cflags <<<"$(pkg-config --cflags adaptive_bvh)"
read -ra libs <<<"$(pkg-config --libs adaptive_bvh)"

# The compiler's warnings of itself are not ours: the flags decide.
builds=(
  "plain: g++ -std=c++17 -O1"
  "O0: g++ -std=c++17 -O0"
  "native: g++ -std=c++17 -O1 -march=native"
  "cpp20: g++ -std=c++20 -O0"
  "clang: clang++-14 -std=c++17 -O0"
)
if grep -qw avx2 /proc/cpuinfo; then builds+=("avx2: g++ -std=c++17 -O1 -mavx2 -mfma"); fi
build() {
  local name=${1%%:*} command
  read -ra command <<<"${1#*:}"
  "${command[@]}" "$here/flags.cpp" "${cflags[@]}" "${libs[@]}" -o "$work/$name"
  "$work/$name" >"$work/$name.txt" || { echo "$1 fails:"; cat "$work/$name.txt"; return 1; }
}
for ((i = 0; i < ${#builds[@]}; i += 2)); do  # two at a time
  build "${builds[i]}" & first=$!
  [ $((i + 1)) -ge ${#builds[@]} ] || build "${builds[i + 1]}"
  wait $first
done
for program in "${builds[@]}"; do
  cmp "$work/plain.txt" "$work/${program%%:*}.txt"
done

# refuses WORDS FLAGS...: every header with types of Eigen says it once, in the preprocessor.
refuses() {
  local words=$1 header
  shift
  for header in "$prefix"/include/adaptive_bvh/*.h; do
    grep -q '#include <\(fcl\|Eigen\)/\|deformable_mesh.h\|/mesh.h' "$header" || continue
    if g++ -std=c++17 -E -I"$prefix/include" -isystem /usr/include/eigen3 "$@" "$header" \
      >/dev/null 2>"$work/refused.txt" || ! grep -q "#error \"adaptive_bvh: .*$words" "$work/refused.txt"
    then
      echo "$header does not refuse $*"
      return 1
    fi
  done
}
alignment=-DEIGEN_MAX_ALIGN_BYTES=16
refuses "$alignment" -mavx2
refuses "$alignment" -DEIGEN_MAX_ALIGN_BYTES=32
refuses EIGEN_DONT_VECTORIZE $alignment -DEIGEN_DONT_VECTORIZE
for flag in -ffast-math -Ofast -ffinite-math-only -funsafe-math-optimizations; do
  refuses -fno-fast-math $flag
done

if nm "$prefix"/lib*/libadaptive_bvh*.a "$prefix"/lib/*/libadaptive_bvh*.a 2>/dev/null |
  grep -E ' [VWu] _ZNK?5Eigen' | grep -v '\.adaptive_bvh$'; then
  echo "these functions of Eigen would be shared with programs"
  exit 1
fi
echo "users' flags: $((${#builds[@]})) programs find the same, 7 kinds of flags are refused"
