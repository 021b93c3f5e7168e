#!/usr/bin/env bash
# Pictures from what `adaptive_bvh_bench --json` wrote:
#   plots.sh RESULTS.json FOLDER            total by method, cost per frame of every scenario
#   plots.sh RESULTS.json FOLDER growth     update and query against size, where several
#                                           resolutions are in the file
# and from what `contact_bench --json` wrote:
#   plots.sh RESULTS.json FOLDER contact    update + query of every case and method
# Needs jq and gnuplot.
set -euo pipefail
results=$1 folder=$2 kind=${3:-totals}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
style='set term pngcairo noenhanced size 900,520 font "sans,11"; set border 3; set tics nomirror; set grid y'

# Median of a list, and the sums over the scenarios of a series.
jq_tools='
  def median: sort | .[(length - 1) / 2 | floor];
  def total: [.update_ms, .query_ms] | transpose | map(add) | median;
'

totals() {
  jq -r "$jq_tools"'.[0].scenarios | map(.methods) | transpose | map({
      title: .[0].title, update: (map(.update_ms | median) | add),
      query: (map(.query_ms | median) | add) })
    | sort_by(.update + .query) | .[] | "\"\(.title)\" \(.update) \(.query)"' \
    "$results" >"$work/totals.dat"
  gnuplot <<GNUPLOT
$style
set output "$folder/totals.png"
set title "Sum of the five scenarios, general orientation (logarithmic)"
set style data histograms; set style histogram clustered gap 1; set style fill solid 0.8
set logscale y; set yrange [1:*]; set ylabel "milliseconds"; set xtics rotate by -35 scale 0 noenhanced; set bmargin 11; set rmargin 18
set key top left
plot "$work/totals.dat" using 2:xtic(1) title "update", '' using 3 title "query"
GNUPLOT

  local count
  count=$(jq '.[0].scenarios | length' "$results")
  for ((i = 0; i < count; ++i)); do
    local name file plots=""
    name=$(jq -r ".[0].scenarios[$i].name" "$results")
    file=$folder/frames_$(echo "$name" | tr ' /.' '___').png
    for key in fcl-rss expert-aabb larsson thesis-ab-or-bc drop-in recorded mesh coherent; do
      jq -r --arg key "$key" ".[0].scenarios[$i].methods[] | select(.key == \$key) | .frame_ms[]" \
        "$results" >"$work/$key.$i.dat"
      [ -s "$work/$key.$i.dat" ] || continue
      plots+="${plots:+, }\"$work/$key.$i.dat\" using 0:1 with lines lw 1.5 title \"$key\""
    done
    gnuplot <<GNUPLOT
$style
set output "$file"
set title "$name: update + query of every frame"
set logscale y; set xlabel "frame"; set ylabel "milliseconds"; set key outside right
plot $plots
GNUPLOT
  done
}

growth() {
  local key plots_update="" plots_query=""
  for key in $(jq -r '.[0].scenarios[0].methods[].key' "$results"); do
    jq -r --arg key "$key" "$jq_tools"'.[] | .scenarios as $all
      | (($all | map(.triangles) | add) / ($all | length)) as $size
      | ($all | map(.frames) | add) as $frames
      | [$all[].methods[] | select(.key == $key)] as $m
      | "\($size) \(($m | map(.update_ms | median) | add) / $frames) \(($m | map(.query_ms | median) | add) / $frames)"' \
      "$results" | sort -n >"$work/$key.dat"
    awk -v key="$key" '{ x = log($1); y = log($2); n++; sx += x; sy += y; sxx += x * x; sxy += x * y }
      END { if (n > 1) printf "%s: the update grows with the power %.2f of the triangles\n", key,
        (n * sxy - sx * sy) / (n * sxx - sx * sx) }' "$work/$key.dat"
    plots_update+="${plots_update:+, }\"$work/$key.dat\" using 1:2 with linespoints title \"$key\""
    plots_query+="${plots_query:+, }\"$work/$key.dat\" using 1:3 with linespoints title \"$key\""
  done
  gnuplot <<GNUPLOT
$style
set output "$folder/growth.png"
set term pngcairo noenhanced size 1200,520 font "sans,11"
set multiplot layout 1,2
set logscale xy; set xlabel "triangles of a scenario, mean"; set key top left
set ylabel "milliseconds a frame"; set title "update"
plot $plots_update
set title "query"
plot $plots_query
unset multiplot
GNUPLOT
}

# A group of bars a case; a case without a method leaves its place empty.
contact() {
  local key title plots=""
  for key in fcl-rss cgal embree embree-planes mesh coherent; do
    title=$(jq -r --arg key "$key" '[.[].methods[] | select(.key == $key) | .title][0] // $key' "$results")
    jq -r --arg key "$key" "$jq_tools"'.[] | select(.job != "continuous")
      | ([.methods[] | select(.key == $key)
          | [.update_ms, .query_ms] | transpose | map(add) | median] | .[0] // "NaN") as $ms
      | "\"\(.job): \(.name | sub("\\.[a-z]+$"; ""))\(
          if .resolution > 1 then " ×\(.resolution * .resolution)" else "" end)\" \($ms)"' \
      "$results" >"$work/$key.dat"
    plots+="${plots:+, }\"$work/$key.dat\" using 2:xtic(1) title \"$title\""
  done
  gnuplot <<GNUPLOT
$style
set term pngcairo noenhanced size 1400,620 font "sans,11"
set output "$folder/contact.png"
set title "Update + query in contact, a step (logarithmic)"
set style data histograms; set style histogram clustered gap 1; set style fill solid 0.8
set logscale y; set ylabel "milliseconds"; set xtics rotate by -30 scale 0 noenhanced
set bmargin 11; set rmargin 12; set key above
plot $plots
GNUPLOT
}

"$kind"
