#!/usr/bin/env bash
# Draws the pictures of hierarchy.md into docs/pictures: patches of triangles above, bounding
# volumes below, at three depths. Arguments: further mesh files to draw.
# Needs f3d, xvfb and imagemagick (all in Debian 12), and the examples built.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
program=${BUILD_DIR:-$root/build/release}/examples/tools/tree_pictures
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# draw NAME "DEPTHS" "CAMERA" MESH...: NAME.png from tree_pictures MESH...
draw() {
  local name=$1 depths=$2 camera=$3 depth what
  shift 3
  for what in patches volumes; do
    for depth in $depths; do
      local flag=
      [ "$what" = volumes ] || flag=--patches
      "$program" "$@" --depth "$depth" $flag --out "$work/$what.$depth.obj"
      # shellcheck disable=SC2086
      xvfb-run -a f3d "$work/$what.$depth.obj" --output="$work/$what.$depth.png" --up=+Z $camera \
        --resolution=420,420 --bg-color=1,1,1 --quiet
      mogrify -trim +repage "$work/$what.$depth.png"
    done
  done
  # shellcheck disable=SC2046
  montage $(for what in patches volumes; do for depth in $depths; do
    echo "$work/$what.$depth.png"; done; done) -tile 3x2 -geometry 300x300+8+8 +dither -colors 255 \
    "PNG8:$root/docs/pictures/$name.png"
}

draw tree_helmet "1 3 5" "--camera-azimuth-angle=35 --camera-elevation-angle=30" helmet
draw tree_cable "1 3 5" "--camera-azimuth-angle=35 --camera-elevation-angle=10" cable --resolution 2
draw tree_plate "1 3 5" "--camera-elevation-angle=80" plate --resolution 4
for file in "$@"; do
  draw "tree_$(basename "${file%.*}")" "2 5 8" "--camera-elevation-angle=20" "$file"
done
