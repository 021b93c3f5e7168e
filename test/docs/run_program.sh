#!/usr/bin/env bash
# Runs a program of the documents and compares what it prints with the output that they show.
#   run_program.sh OUTPUT.txt COMMAND ...
# Without the file OUTPUT.txt the program only has to end without an error.
set -euo pipefail
expected=$1
shift
printed=$("$@")
echo "$printed"
[ ! -f "$expected" ] || diff "$expected" <(echo "$printed")
