#!/usr/bin/env bash
# Writes every complete program of Markdown files into a folder.
#   extract_programs.sh FOLDER FILE.md ...
# A program is a block ```cpp with a function main, or a block ```python that imports adaptive_bvh.
# The n-th program of guide.md becomes guide_<n>.cpp or guide_<n>.py. A block ```text that follows it
# directly is its output, and becomes guide_<n>.txt. Files that would not change keep their times.
set -euo pipefail
folder=$1
shift
new=$(mktemp -d)
trap 'rm -rf "$new"' EXIT
for file in "$@"; do
  awk -v start="$new/$(basename "$file" .md)" '
    !language && /^```[a-z]/ { language = substr($0, 4); block = ""; next }
    language && /^```$/ {
      suffix = ""
      if (language == "cpp" && block ~ /(^|\n)int main\(/) suffix = ".cpp"
      if (language == "python" && block ~ /(^|\n)import adaptive_bvh/) suffix = ".py"
      if (suffix != "") program = start "_" ++count
      if (language == "text" && program != "") suffix = ".txt"
      if (suffix != "") printf "%s", block >(program suffix)
      if (suffix == ".txt") program = ""
      language = ""
      next
    }
    language { block = block $0 "\n"; next }
    /[^ ]/ { program = "" }' "$file"
done
mkdir -p "$folder"
for old in "$folder"/*; do
  [ -e "$new/$(basename "$old")" ] || rm -f "$old"
done
for program in "$new"/*; do
  cmp -s "$program" "$folder/$(basename "$program")" || cp "$program" "$folder"
done
