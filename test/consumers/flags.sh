#!/usr/bin/env bash
# Users' compiler flags with an installed library:
#   flags.sh PREFIX WORK    an installation, and a folder for the programs
# flags.cpp is compiled with each set of flags below; all programs must find the same bits, also on a
# processor without AVX2. Flags that cannot work are refused in one sentence, and the library shares
# no function of Eigen with programs. Needs x86-64, pkg-config, clang-14 and qemu-user.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
prefix=$1 work=$2
mkdir -p "$work"
PKG_CONFIG_PATH=$(dirname "$(find "$prefix" -name adaptive_bvh.pc)")
export PKG_CONFIG_PATH
read -ra cflags <<<"$(pkg-config --cflags adaptive_bvh)"
read -ra libs <<<"$(pkg-config --libs adaptive_bvh)"

# Products and sums are fused from -O1 on; -O0 compiles in half of the time.
builds=(
  "native: g++ -std=c++17 -O1 -march=native"
  "O0: g++ -std=c++17 -O0"
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
  cmp "$work/O0.txt" "$work/${program%%:*}.txt"
done
# The library chooses code for AVX2 when it runs. This processor has none.
qemu-x86_64 -cpu Nehalem "$work/O0" >"$work/emulated.txt"
cmp "$work/O0.txt" "$work/emulated.txt"

# refuses HEADER WORDS FLAGS...: the header is refused with these words by the preprocessor.
refuses() {
  local header=$1 words=$2
  shift 2
  if g++ -std=c++17 -E -I"$prefix/include" -isystem /usr/include/eigen3 "$@" "$header" \
    >/dev/null 2>"$work/refused.txt" || ! grep -qe "error: .*adaptive_bvh: .*$words" "$work/refused.txt"
  then
    echo "$header does not refuse $*"
    return 1
  fi
}
alignment=-DEIGEN_MAX_ALIGN_BYTES=16
for header in "$prefix"/include/adaptive_bvh/*.h; do  # those with types of Eigen
  if grep -q '#include \(<fcl/\|<Eigen/\|.*deformable_mesh.h\)' "$header"; then
    refuses "$header" "$alignment" -mavx2
  fi
done
check=$prefix/include/adaptive_bvh/build_flags.h
refuses "$check" "$alignment" -DEIGEN_MAX_ALIGN_BYTES=32
refuses "$check" EIGEN_DONT_VECTORIZE $alignment -DEIGEN_DONT_VECTORIZE
for flag in -ffast-math -Ofast -ffinite-math-only -funsafe-math-optimizations; do
  refuses "$check" -fno-fast-math $flag
  g++ -std=c++17 -E -I"$prefix/include" -isystem /usr/include/eigen3 $flag -fno-fast-math "$check" \
    >/dev/null 2>"$work/accepted.txt" || { cat "$work/accepted.txt"; exit 1; }
done

if nm "$prefix"/lib*/libadaptive_bvh*.a "$prefix"/lib/*/libadaptive_bvh*.a 2>/dev/null |
  grep -E ' [VWu] _ZNK?5Eigen' | grep -v '\.adaptive_bvh$'; then
  echo "these functions of Eigen would be shared with programs"
  exit 1
fi
echo "users' flags: ${#builds[@]} programs find the same bits; what cannot work is refused"
