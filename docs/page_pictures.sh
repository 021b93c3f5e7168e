#!/usr/bin/env bash
# Draws the pictures of recorded pages into docs/pictures, by headless Chromium with software WebGL.
# Needs chromium and imagemagick (both in Debian 12), and the examples and the Python module built.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
build=${BUILD_DIR:-$root/build/release}
examples=$build/examples
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# draw NAME PAGE WIDTH,HEIGHT FRAGMENT [OPTION ...]: NAME.png, of what PAGE#FRAGMENT shows
draw() {
  local name=$1 page=$2 size=$3 fragment=$4
  shift 4
  chromium --headless=new --no-sandbox --disable-dev-shm-usage --use-angle=swiftshader \
    --enable-unsafe-swiftshader --hide-scrollbars --window-size="$size" --virtual-time-budget=3000 \
    --user-data-dir="$work/profile" --screenshot="$work/$name.png" "$@" \
    "file://$work/$page.html#$fragment" 2>/dev/null
  convert "$work/$name.png" +dither -colors 255 -strip "PNG8:$root/docs/pictures/$name.png"
}

"$examples/tools/compare_with_fcl" --page "$work/helmet.html"
"$examples/08_clearance" --page "$work/clearance.html"
"$examples/12_gripper" --page "$work/gripper.html" >/dev/null
"$examples/tools/harness" "$work/harness" >/dev/null
status=0  # 1: the clearance is not kept
PYTHONPATH=$build/python /usr/bin/python3 -m adaptive_bvh clearance --clearance 5mm \
  --moving "$work/harness/harness_*.ply" --parts "$work"/harness/bay/*.stl \
  --report "$work/harness.html" >/dev/null || status=$?
test "$status" -eq 1
for program in tutorial contact_signs; do
  PYTHONPATH=$build/python /usr/bin/python3 "$root/python/examples/$program.py" \
    "$work/$program.html" >/dev/null
done
draw page_harness harness 1280,720 "view=0.55,0.5,0.62,0,0.1,0"
draw page helmet 1280,740 "frame=113"
draw page_clearance clearance 900,620 "frame=9"
draw page_phone helmet 390,760 "frame=150" --force-device-scale-factor=1.5 \
  --blink-settings=preferredColorScheme=0
draw page_tutorial tutorial 1100,680 "frame=28"
draw page_signs contact_signs 1000,700 "frame=3&view=0.12,0.16,0.55,0,-0.5,0"
draw page_gripper gripper 1000,640 "frame=100&view=0.75,0.35,0.95,0,0,0"
