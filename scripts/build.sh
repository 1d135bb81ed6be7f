#!/usr/bin/env bash
# Configures and builds the release preset in build/release.
#
#   scripts/build.sh [TARGET]...      (all targets without arguments)
#
# ETALON_JOBS sets how many compilers run at once (default: one a core, and 2.6 GB of memory each).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

for argument in "$@"; do
  if [[ $argument == -* ]]; then
    echo "build.sh: unknown argument '$argument'; expected targets" >&2
    exit 2
  fi
done

folder=build/release
log=$folder/build.log
mkdir -p "$folder"

if [[ -z ${ETALON_JOBS:-} ]]; then
  by_memory=$(awk '/^MemAvailable/ {print int($2 / 2600000)}' /proc/meminfo)
  cores=$(nproc)
  ETALON_JOBS=$((by_memory < cores ? by_memory : cores))
  ((ETALON_JOBS >= 1)) || ETALON_JOBS=1
fi

fail() {
  echo "build: $1; the end of $log:" >&2
  tail -n 40 "$log" >&2
  exit 1
}

echo "build: configuring"
cmake --preset release >"$log" 2>&1 || fail "configuring failed"

targets=()
(($# == 0)) || targets=(--target "$@")
echo "build: compiling with $ETALON_JOBS jobs"
# On a terminal Ninja rewrites one line. In a log a line every 5 % tells that it is alive.
if [[ -t 1 ]]; then
  cmake --build --preset release -j "$ETALON_JOBS" "${targets[@]}" || {
    echo "build: compiling failed, see above" >&2
    exit 1
  }
else
  set +e
  cmake --build --preset release -j "$ETALON_JOBS" "${targets[@]}" 2>&1 | tee -a "$log" |
    awk '
      match($0, /^\[[0-9]+\/[0-9]+\]/) {
        split(substr($0, 2, RLENGTH - 2), done, "/")
        share = int(20 * done[1] / done[2])
        if (share > shown) { shown = share; print "build: " $1; fflush() }
        next
      }
      /warning:/ { print; fflush() }'
  status=${PIPESTATUS[0]}
  set -e
  ((status == 0)) || fail "compiling failed"
fi
echo "build: done, programs in $folder/bin"
