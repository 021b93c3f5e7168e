#!/usr/bin/env bash
# Pictures from what `adaptive_bvh_bench --json` wrote:
#   plots.sh RESULTS.json FOLDER            total by method, cost per step of every scenario
#   plots.sh RESULTS.json FOLDER growth     update and query against size, where several
#                                           resolutions are in the file
# and from what `contact_bench --json` wrote:
#   plots.sh RESULTS.json FOLDER contact    update + query of every case and method
# This library is blue, others are grey. Needs jq and gnuplot.
set -euo pipefail
results=$1 folder=$2 kind=${3:-totals}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
blue='#1f6feb'

# Median of a list; update + query by repeat; two significant digits; the short name of a method,
# and whether it is of this library.
# shellcheck disable=SC2016
jq_tools='
  def median: sort | .[(length - 1) / 2 | floor];
  def total: [.update_ms, .query_ms] | transpose | map(add) | median;
  def digits: if . <= 0 then "0" else
    (. as $x | (($x | log10 | floor) - 1) as $e | pow(10; $e) as $unit
    | (($x / $unit | round) * $unit) as $rounded
    | if $e >= 0 then $rounded | round | tostring
      else (($rounded * pow(10; -$e) | round | tostring) as $d
        | if $e == -1 then $d[:-1] + "." + $d[-1:]
          else "0." + ("0" * (-$e - ($d | length))) + $d end) end) end;
  def title: {
      coherent: "CoherentDistance", mesh: "adaptive_bvh::distance of meshes",
      recorded: "adaptive_bvh::distance of models", "drop-in": "drop-in, fcl::distance",
      "drop-in-all": "drop-in that refits all", "recorded-ab": "models, tests A and B",
      "recorded-obbrss": "adaptive_bvh::distance, OBBRSS", "drop-in-obbrss": "drop-in, OBBRSS",
      "expert-aabb": "FCL AABB, no copies, last pair" }[.key] // .title;
  def is_ours: .key | test("^(coherent|mesh|recorded|drop-in|thesis|threads)");
'

# bars FILE TITLE: horizontal bars on a logarithmic axis. $work/bars has a line a bar, from the top:
# position, milliseconds, 1 for this library, "text at its end", "text before its group, or empty".
bars() {
  local count top labels left
  count=$(wc -l <"$work/bars")
  top=$(awk '{ if ($1 > y) y = $1 } END { print y + 1 }' "$work/bars")
  labels=$(awk -F'"' 'split($1, field, " ") && $4 != "" {
    printf "%s\"%s\" %s", comma, $4, -field[1]; comma = ", " }' "$work/bars")
  left=$(awk -F'"' 'length($4) > n { n = length($4) } END { print n + 2 }' "$work/bars")
  gnuplot <<GNUPLOT
set term pngcairo noenhanced size 1000,$((count * 17 + 130)) font "sans,10"
set output "$1"
set title "$2" font "sans,12"
stats "$work/bars" using 2 nooutput
set logscale x; set xlabel "milliseconds, logarithmic"
set border 1; set xtics nomirror; set grid x lc rgb "#e0e0e0"; unset key
set yrange [-$top:0]; set ytics ($labels) scale 0; set lmargin $left; set rmargin 4
low = 10 ** floor(log10(STATS_min) - 0.3)
set xrange [low:STATS_max * 8]
colour(is_ours) = is_ours > 0 ? 0x${blue#\#} : 0x9e9e9e
plot "$work/bars" using 2:(-\$1):(low):2:(-\$1 - 0.4):(-\$1 + 0.4):(colour(\$3)) \
    with boxxyerror fs solid 1 noborder lc rgb variable, \
  '' using 2:(-\$1):4 with labels left offset 0.5,0 font "sans,9"
GNUPLOT
}

totals() {
  jq -r "$jq_tools"'.[0].scenarios | map(.methods) | transpose
    | map(.[0] + { total: (map(total) | add) } | select(.key != "fcl-rss-bottom-up"))
    | sort_by(.total) | to_entries[]
    | "\(.key + 1) \(.value.total) \(if .value | is_ours then 1 else 0 end) " +
      "\"\(.value.total | digits)\" \"\(.value | title)\""' \
    "$results" >"$work/bars"
  bars "$folder/totals.png" "Update + exact distance, sum of the scenarios, general orientation"

  local count
  count=$(jq '.[0].scenarios | length' "$results")
  for ((i = 0; i < count; ++i)); do
    local name file plots="" style
    name=$(jq -r ".[0].scenarios[$i].name" "$results")
    file=$folder/frames_$(echo "$name" | tr ' /.' '___').png
    while read -r key style; do
      jq -r --arg key "$key" ".[0].scenarios[$i].methods[] | select(.key == \$key) | .frame_ms[]" \
        "$results" >"$work/$key.$i.dat"
      [ -s "$work/$key.$i.dat" ] || continue
      title=$(jq -r --arg key "$key" \
        "$jq_tools .[0].scenarios[$i].methods[] | select(.key == \$key) | title" "$results")
      plots+="${plots:+, }\"$work/$key.$i.dat\" using 0:1 with lines $style title \"$title\""
    done <<LINES
fcl-rss lc rgb "#616161" lw 1.5
expert-aabb lc rgb "#9e9e9e" lw 1.5
larsson lc rgb "#9e9e9e" lw 1.5 dt 2
thesis-ab-or-bc lc rgb "$blue" lw 1.2 dt 3
drop-in lc rgb "$blue" lw 1.2 dt 2
coherent lc rgb "$blue" lw 2
LINES
    gnuplot <<GNUPLOT
set term pngcairo noenhanced size 900,520 font "sans,11"
set border 3; set tics nomirror; set grid y lc rgb "#e0e0e0"
set output "$file"
set title "$name: update + query of each step"
set logscale y; set xlabel "step"; set ylabel "milliseconds, logarithmic"; set key below maxrows 2
plot $plots
GNUPLOT
  done
}

growth() {
  local key title style plots_update="" plots_query=""
  while read -r key style; do
    jq -r --arg key "$key" "$jq_tools"'.[] | .scenarios as $all
      | (($all | map(.triangles) | add) / ($all | length)) as $size
      | ($all | map(.frames) | add) as $frames
      | [$all[].methods[] | select(.key == $key)] as $m | select($m | length > 0)
      | [$size, ($m | map(.update_ms | median) | add) / $frames,
          ($m | map(.query_ms | median) | add) / $frames] | @tsv' \
      "$results" | sort -n >"$work/$key.dat"
    [ -s "$work/$key.dat" ] || continue
    title=$(jq -r --arg key "$key" \
      "$jq_tools"'[.[0].scenarios[0].methods[] | select(.key == $key)][0] | title' "$results")
    style="with linespoints $style title \"$title\""
    plots_update+="${plots_update:+, }\"$work/$key.dat\" using 1:2 $style"
    plots_query+="${plots_query:+, }\"$work/$key.dat\" using 1:3 $style"
  done <<LINES
fcl-rss lc rgb "#616161" lw 1.5 pt 7
expert-aabb lc rgb "#9e9e9e" lw 1.5 pt 5
drop-in lc rgb "$blue" lw 1.2 dt 3 pt 4
recorded lc rgb "$blue" lw 1.2 dt 4 pt 8
mesh lc rgb "$blue" lw 1.5 dt 2 pt 6
coherent lc rgb "$blue" lw 2 pt 7
LINES
  gnuplot <<GNUPLOT
set term pngcairo noenhanced size 1200,540 font "sans,11"
set border 3; set tics nomirror; set grid y lc rgb "#e0e0e0"
set output "$folder/growth.png"
set multiplot layout 1,2 margins 0.07,0.98,0.27,0.92 spacing 0.09
set logscale xy; set xlabel "triangles, logarithmic"
set key at screen 0.5,0.12 center center horizontal maxrows 2 reverse Left
set format x "%.0f"; set xtics 10; set ylabel "milliseconds a step, logarithmic"
set title "update"
plot $plots_update
set title "query"; unset key
plot $plots_query
unset multiplot
GNUPLOT
}

# A group of bars a case, this library first. Embree's bar is the faster of its two rows.
contact() {
  jq -r "$jq_tools"'
    def name: (.job + ": " + (.name | sub("\\.[a-z]+$"; "")))
      + if .resolution > 1 then " ×\(.resolution * .resolution)" else "" end;
    [.[] | select(.job != "continuous") | name as $name
      | [.methods[] | . + { ms: total }] as $all
      | [($all[] | select(.key == "mesh") + { text: "adaptive_bvh", ours: 1 }),
         (([$all[] | select(.key | test("^embree(-planes)?$"))] | min_by(.ms) // empty)
           + { text: "Embree", ours: 0 }),
         ($all[] | select(.key == "cgal") + { text: "CGAL", ours: 0 }),
         ($all[] | select(.key == "fcl-rss") + { text: "FCL", ours: 0 })]
      | to_entries | map(.value + { name: (if .key == 0 then $name else "" end) })]
    | to_entries | map(.key as $group | .value[] + { group: $group }) | to_entries[]
    | .key as $row | .value
    | "\($row + 1 + .group * 0.7) \(.ms) \(.ours) \"\(.text) \(.ms | digits)\" \"\(.name)\""' \
    "$results" >"$work/bars"
  bars "$folder/contact.png" "Update + query in contact, a step"
}

"$kind"
