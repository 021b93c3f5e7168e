#!/usr/bin/env bash
# Measures all figures of the documents, and writes their tables and pictures, and all times as
# docs/figures.csv; `docs/figures_csv.py compare OLD NEW` names rows that became slower.
#   docs/figures.sh [OPTION ...] [PART ...]
#   --data FOLDER    the frames of simulations, see docs/performance.md; without them their tables
#                    stay as they are
#   --quick          a trial in about half a minute: the smallest sizes, once, into copies of the
#                    documents in build/figures-quick/documents
#   --once           full sizes, but every measurement once, in a third of the time
#   --allow-changes  also with sources that are not committed
#   --no-build       takes the programs that are there
# Without PART: everything, below half an hour on two quiet cores. A part alone, for example
# `docs/figures.sh contact scenes`, uses the other parts' results of the last run if no source has
# changed since. BUILD_DIR is the build folder, a Release build; build/release if it is not set.
# Needs python3, gnuplot and jq; for all rows of peers also libembree-dev and libcgal-dev.
# shellcheck disable=SC2046,SC2086  # options of one word each are split on purpose
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
build=${BUILD_DIR:-$root/build/release}
data=${FIGURES_DATA:-} quick='' once='' allow_changes='' no_build=''
parts=()
while [ $# -gt 0 ]; do
  case $1 in
    --data) data=$2 && shift ;;
    --quick) quick=yes ;;
    --once) once=yes ;;
    --allow-changes) allow_changes=yes ;;
    --no-build) no_build=yes ;;
    -h | --help) sed -n '2,/^# shellcheck/{/^# shellcheck/!s/^# \{0,1\}//p}' "$0" && exit ;;
    -*) echo "figures.sh: no option '$1'" >&2 && exit 2 ;;
    *) parts+=("$1") ;;
  esac
  shift
done
results=$root/build/figures${quick:+-quick}
sources=(CMakeLists.txt cmake include src examples python test/benchmark ':!*.sh' ':!*.md')

# either QUICK FULL: one of two values
either() { if [ "$quick" ]; then echo "$1"; else echo "$2"; fi; }
# repeats NUMBER: or once
repeats() { if [ "$quick$once" ]; then echo 1; else echo "$1"; fi; }

# measure NAME PROGRAM [ARGUMENT ...]: what it prints, as NAME.txt of the results
measure() {
  local name=$1 program=$2 status=0 TIMEFORMAT='  %R s, of these %U s of a processor'
  shift 2
  echo "$name: $program $*" | sed "s#${data:-^$}/##g; s#$results/##g"
  time "$build/$program" "$@" >"$results/$name.part" || status=$?
  if [ "$status" -ne 0 ]; then
    echo "figures.sh: $name failed with status $status" >&2
    return 1
  fi
  mv "$results/$name.part" "$results/$name.txt"
  [ ! -e "$results/new.json" ] || mv "$results/new.json" "$results/$name.json"
}
json=(--json "$results/new.json")
bench=test/benchmark

# distances NAME "METHODS" [ARGUMENT ...]: a run of adaptive_bvh_bench; all methods if "" is given
distances() {
  local name=$1 chosen=() method
  for method in $2; do chosen+=(--method "$method"); done
  shift 2
  measure "$name" $bench/adaptive_bvh_bench --quiet "${json[@]}" "${chosen[@]}" "$@"
}

# Frames of simulations, and the option for them. Without them a quick trial measures other bodies.
poses=() with_poses=()
if [ "$data" ]; then
  for name in armadillo_rollers_326 armadillo_rollers_327 cloth_funnel_227 cloth_funnel_228; do
    poses+=("$data/$name.ply")
  done
  with_poses=(--poses "${poses[@]}")
fi
has_data() {
  [ "$data" ] || { echo "$1: skipped, as --data is not given" && return 1; }
}

all_parts=(thesis large motions frames growth contact continuous steps sets threads proximity cliff
  scenes shapes forces octree update trees micro python)

one_scenario=()
[ ! "$quick" ] || one_scenario=(--scenario "helmet and plate")

part_thesis() {
  distances thesis "" --orientation both --repeats "$(repeats 3)" "${one_scenario[@]}"
  measure describe $bench/adaptive_bvh_bench --describe --further
}
part_large() {
  distances large "coherent mesh drop-in drop-in-all recorded-ab fcl-rss expert-aabb" \
    --orientation both --resolution "$(either 2 4)" --repeats "$(repeats 3)" "${one_scenario[@]}"
  distances thesis-large "thesis-a thesis-ab thesis-ab-or-bc thesis-all larsson drop-in-obbrss
    fcl-obbrss" --orientation general --resolution "$(either 2 4)" --repeats 1 "${one_scenario[@]}"
}
part_motions() {
  distances stride "coherent mesh drop-in drop-in-all recorded-ab fcl-rss expert-aabb" --stride 4 \
    --orientation general --resolution 1 --resolution "$(either 2 4)" --repeats "$(repeats 3)" \
    "${one_scenario[@]}"
  distances moving "coherent mesh drop-in fcl-rss expert-aabb" --moving --orientation general \
    --resolution 1 --resolution "$(either 2 4)" --repeats "$(repeats 3)" "${one_scenario[@]}"
  distances further "coherent mesh drop-in fcl-rss expert-aabb" --further --orientation general \
    --resolution "$(either 1 2)" --repeats "$(repeats 3)" \
    $(either "--scenario poke --scenario tumble" "")
}
part_frames() {
  has_data frames || return 0
  distances frames "mesh drop-in drop-in-all fcl-rss" --orientation general \
    --repeats "$(repeats 5)" --scenario .ply "${with_poses[@]}"
}
part_growth() {
  local sizes=() size
  for size in $(either "1 2 4" "1 2 4 8 16 28 39"); do sizes+=(--resolution "$size"); done
  distances growth "coherent mesh drop-in expert-aabb fcl-rss" --scenario "plate and twisting" \
    --orientation general --stride 4 --repeats 1 "${sizes[@]}"
}
part_contact() {
  [ "$quick" ] || has_data contact || return 0
  local jobs=(--job self-collision --job collide --job distance)
  measure contact $bench/contact_bench --quiet "${json[@]}" "${jobs[@]}" --split \
    "${with_poses[@]}" --resolution "$(either 1 4)" --repeats "$(repeats 2)"
  measure contact-dense $bench/contact_bench --quiet "${json[@]}" --job self-collision \
    --scenario coiling --scenario crumpled --resolution "$(either 2 12)" --repeats 1
}
part_continuous() {
  [ "$quick" ] || has_data continuous || return 0
  measure continuous $bench/contact_bench --quiet "${json[@]}" --job continuous \
    "${with_poses[@]}" --resolution "$(either 1 4)" --repeats "$(repeats 2)"
}
part_steps() {
  has_data steps || return 0
  measure steps $bench/step_bench --poses "${poses[@]}" --repeats "$(repeats 9)"
}
part_sets() {
  measure sets $bench/contact_set_bench $(either "--small --steps 8" "") ${data:+--data "$data"}
}
part_threads() {
  measure threads $bench/contact_bench --quiet "${json[@]}" --threads 2 --scenario rods \
    --job self-collision --job continuous --method mesh --method threads --method continuous \
    --method continuous-threads --resolution "$(either 1 4)" --repeats "$(repeats 3)"
}
part_proximity() {
  [ "$quick" ] || has_data proximity || return 0
  local questions=(--question "0.5 edges" --question nearer)
  [ "$quick" ] || questions+=(--question "2 edges, two")
  measure proximity $bench/contact_bench proximity "${with_poses[@]}" --repeats "$(repeats 2)" \
    "${questions[@]}"
  either 1000 20000 >"$results/points.many"
  measure points $bench/contact_bench proximity "${with_poses[@]:0:3}" \
    --question points --question rays --many "$(either 1000 20000)" --repeats "$(repeats 2)"
}
part_cliff() {
  measure cliff $bench/cliff_bench --repeats "$(repeats 2)" --frames "$(either 3 8)" \
    $(either "--scenario plates --scenario spheres" "")
}
part_scenes() { measure scenes $bench/scene_bench $(either "--small --steps 4" "--steps 24"); }
part_shapes() {
  has_data shapes || return 0
  measure shapes-armadillo_rollers $bench/shape_bench --poses "${poses[@]:0:2}"
  measure shapes-cloth_funnel $bench/shape_bench --poses "${poses[@]:2:2}"
}
part_forces() {
  measure forces $bench/contact_force_bench --repeats "$(repeats 5)" --points "$(either 200 3000)"
}
part_octree() {
  measure octree $bench/octree_bench --rounds "$(repeats 5)" --cell 0.02 --cell 0.2 \
    --columns 16 --columns "$(either 32 64)"
}
part_update() {
  measure update $bench/update_bench --rounds "$(repeats 9)" --largest "$(either 2 16)"
}
part_trees() {
  measure builds $bench/hierarchy_bench $(either --small-builds --no-scenarios) \
    --repeats "$(repeats 3)"
  measure trees $bench/hierarchy_bench --no-builds --repeats "$(repeats 3)" --resolution 1 \
    $(either "" "--resolution 4")
}
part_micro() {
  local names="volumeTest/8|triangleTest|refit/"
  names+="|(displacement|propagation|refitAll)/$(either 1 "(1|16)")/1"
  measure micro $bench/micro_bench --benchmark_format=json --benchmark_filter="^($names)" \
    --benchmark_min_time="$(either 0.001 0.1)"
  mv "$results/micro.txt" "$results/micro.json"
}
part_python() {
  [ -e "$build/$bench/libpython_bench.so" ] || { echo "python: skipped, not built" && return 0; }
  export PYTHONPATH=$build/python
  echo "python: test/benchmark/python_bench.py"
  /usr/bin/python3 -B "$root/$bench/python_bench.py" "$build/$bench/libpython_bench.so" \
    --size "$(either 50 500)" --rounds "$(either 10 100)" >"$results/python.txt"
}

# One line on what was measured, where: no names of hosts or folders
write_provenance() {
  local processor compiler remarks
  processor=$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)
  compiler=$(cat "$build"/CMakeFiles/*/CMakeCXXCompiler.cmake | sed -n \
    's/^set(CMAKE_CXX_COMPILER_\(ID\|VERSION\) "\(.*\)")/\2/p' | head -n 2 | tr '\n' ' ')
  remarks=$(awk -v idle=0.7 '$1 > idle { print " Other programs ran meanwhile: times are rough." }' \
    "$results/load")
  [ -e "$results/frames.json" ] ||
    remarks+=" Tables of frames of simulations are of an earlier commit."
  echo "Measured at commit \`$(cat "$results/commit")\`, $(date -u +%F), on ${processor:-unknown}" \
    "with $(nproc) cores; compiled by ${compiler% } in Release mode (-O3).$remarks" \
    >"$results/provenance"
}

{ # read as a whole, so that the script can be edited while it runs
  for part in "${parts[@]}"; do
    [[ " ${all_parts[*]} " = *" $part "* ]] ||
      { echo "figures.sh: no part '$part'; there are ${all_parts[*]}" >&2 && exit 2; }
  done
  cd "$root"
  commit=$(git rev-parse --short HEAD)
  if [ "$(git status --porcelain -- "${sources[@]}")" ]; then
    [ "$allow_changes$quick" ] ||
      { echo "figures.sh: sources are not committed; --allow-changes for a trial" >&2 && exit 1; }
    commit+=" with changes"
  fi
  mkdir -p "$results"
  if [ ${#parts[@]} -eq 0 ]; then
    rm -rf "${results:?}"/*
    echo "$commit" >"$results/commit"
    parts=("${all_parts[@]}")
  elif [ ! -e "$results/commit" ]; then
    echo "$commit" >"$results/commit"
  elif [ ! "$quick$allow_changes" ] &&
    ! git diff --quiet "$(cut -d' ' -f1 "$results/commit")" HEAD -- "${sources[@]}"; then
    echo "figures.sh: the other parts were measured at $(cat "$results/commit"): run all" >&2
    exit 1
  fi
  grep -q 'CMAKE_BUILD_TYPE:[A-Z]*=Release' "$build/CMakeCache.txt" ||
    { echo "figures.sh: $build is not a Release build" >&2 && exit 1; }
  [ -s "$results/load" ] || cat /proc/loadavg >"$results/load"
  [ "$no_build" ] || cmake --build "$build" --target benchmarks
  start=$SECONDS
  for part in "${parts[@]}"; do "part_$part"; done

  documents=$root
  if [ "$quick" ]; then
    documents=$results/documents
    rm -rf "$documents" && mkdir -p "$documents/docs"
    cp README.md "$documents"
    cp -r docs/*.md docs/pictures "$documents/docs"
  fi
  write_provenance
  # test/peers/run.sh measures newer libraries, which it installs.
  [ ! -e build/peers/peers.csv ] || cp build/peers/peers.csv "$results/peers.csv"
  python3 -B docs/figures.py write "$results" "$documents"
  python3 -B docs/figures_csv.py write "$results" "$documents/docs/figures.csv"
  for kind in contact growth totals; do
    name=$kind
    [ $kind != totals ] || name=thesis
    [ ! -e "$results/$name.json" ] ||
      test/benchmark/plots.sh "$results/$name.json" "$documents/docs/pictures" $kind
  done
  python3 -B docs/figures.py check "$documents"
  echo "$((SECONDS - start)) s"
  exit
}
