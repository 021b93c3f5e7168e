#!/usr/bin/env bash
# Runs a command on a system that lacks the libraries that a wheel brings along: empty files take their
# place. For a mount namespace of its own: unshare --mount test/without_libraries.sh COMMAND ...
set -euo pipefail
for library in /usr/lib/*/lib{fcl,ccd,octomap,octomath,assimp,tbb,draco,minizip}.so*; do
  [ ! -f "$library" ] || mount --bind /dev/null "$library"
done
exec "$@"
