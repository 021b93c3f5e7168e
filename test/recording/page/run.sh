#!/usr/bin/env bash
# Opens the pages that record_runs writes in headless Chromium with software WebGL, at the width of
# a desk and of a phone, drives them (drive.js), and fails on any difference, script error or request.
#   run.sh RECORD_RUNS FOLDER [CHROMIUM]
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
record_runs=$1 folder=$2 chromium=${3:-chromium}
mkdir -p "$folder"
"$record_runs" "$folder"

# page NAME: NAME.html with the driver behind it, and a net under it that catches errors.
driven_page() {
  local name=$1
  sed '0,/<head>/s||<head><script>window.pageErrors=[];for(const k of["error","warn"])console[k]=(...a)=>window.pageErrors.push(a.join(" "));window.onerror=(m)=>{window.pageErrors.push(m)};window.addEventListener("securitypolicyviolation",(e)=>window.pageErrors.push("loads "+e.blockedURI));</script>|' \
    "$folder/$name.html"
  echo "<script>const expected = "
  cat "$folder/$name.json"
  echo ";</script><script>"
  cat "$here/drive.js"
  echo "</script>"
}

# drive NAME WIDTH HEIGHT FRAGMENT [OPTION ...]
drive() {
  local name=$1 size=$2,$3 fragment=$4 profile out=$folder/$1.$2.$4.txt
  shift 4
  profile=$(mktemp -d)
  driven_page "$name" >"$folder/$name.driven.html"
  timeout 120 "$chromium" --headless=new --no-sandbox --disable-dev-shm-usage \
    --use-angle=swiftshader --enable-unsafe-swiftshader --hide-scrollbars --window-size="$size" \
    --user-data-dir="$profile" "$@" --dump-dom "file://$folder/$name.driven.html#$fragment" \
    2> >(grep -v dbus/ >"$folder/$name.log") | sed -n '/id="findings"/,/^END/p' >"$out" || true
  rm -rf "$profile" "$folder/$name.driven.html"
  sed "s/.*FINDINGS/$name, $fragment:/; /^END/d; /^$/d" "$out"
  grep -q 'FINDINGS [1-9][0-9]* checks, 0 failures' "$out" || { tail -5 "$folder/$name.log"; return 1; }
}

# The large run's first picture comes within 3 seconds. On a busy machine it may be late once.
drive_large() {
  local try ms
  for try in 1 2 3; do
    drive large 1280 800 large
    ms=$(sed -n 's/.*first picture \([0-9]*\) ms.*/\1/p' "$folder/large.1280.large.txt")
    if [ "$ms" -le 3000 ]; then return; fi
  done
  return 1
}

drive_large
drive helmet 1280 800 all
drive contacts 1280 800 all
drive meshes 1280 800 all
drive scene 1280 800 all
drive helmet 500 844 phone
drive scene 500 844 phone
drive helmet 1280 800 play --virtual-time-budget=30000
test "$(stat -c %s "$folder/large.html")" -le 12000000
