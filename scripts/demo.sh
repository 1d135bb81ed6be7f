#!/usr/bin/env bash
# From nothing to a comparison of initializers, on a fresh Debian 12: installs what is missing,
# builds, simulates a short flight, converts it to a rawlog, replays it with each initializer, and
# compares the runs. Everything that it writes is in out/demo. A second call skips the flight, the
# conversion and the replays that are newer than the programs and what they read.
#
#   scripts/demo.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

if (($# > 0)); then
  echo "demo.sh: unknown argument '$1'; expected none" >&2
  exit 2
fi

out=out/demo
flight=$out/flight
log=$out/flight.rawlog
etalon=build/release/bin/etalon
step=0

announce() {
  step=$((step + 1))
  printf '\n== %d. %s\n' "$step" "$1"
}

run() {
  printf '$ %s\n' "$*"
  "$@"
}

# Whether the file is there and newer than the programs, the plugins and the other files.
is_done() {
  local result=$1 input
  [[ -f $result ]] || return 1
  shift
  while read -r input; do
    [[ $result -nt $input ]] || return 1
  done < <(printf '%s\n' "$@" "$etalon" && find build/release/lib -name '*.so*' -type f)
}

announce "Packages"
scripts/install_dependencies.sh

announce "Build"
plugins=()
for file in plugins/initializers/*/CMakeLists.txt; do
  plugins+=("etalon_initializer_$(basename "$(dirname "$file")")")
done
scripts/build.sh etalon "${plugins[@]}"
sections=$("$etalon" plugins --ini)
mapfile -t initializers < <(sed -nE 's/^\[(.+)\]$/\1/p' <<<"$sections")

announce "Simulate a flight of 8 s: stereo images, IMU, ground truth"
simulate=("$etalon" simulate --out "$flight" --force --seed 1 --duration 8 --profile aggressive)
# Done before if the same command of the same simulator wrote it.
made_by=$(sha256sum build/release/lib/libetalon_{simulation,core}.so)
made_by+=" ${simulate[*]}"
if [[ -f $out/flight.made_by && $(<"$out/flight.made_by") == "$made_by" ]]; then
  echo "$flight is there already"
else
  mkdir -p "$out"
  rm -f "$out/flight.made_by"
  run "${simulate[@]}"
  printf '%s\n' "$made_by" >"$out/flight.made_by"
fi

announce "Look at the recording"
run "$etalon" info "$flight"

announce "Convert it to an MRPT rawlog"
if is_done "$log" "$out/flight.made_by"; then
  echo "$log is there already"
else
  run "$etalon" convert "$flight" "$log"
fi

# Replays the rawlog; exit code 1, never initialized, is a result, too, that the comparison shows.
replay() {
  local initializer=$1 status=0
  if is_done "$out/$initializer/config.ini" "$log"; then  # the last file that a replay writes
    echo "$out/$initializer is there already"
  else
    run "$etalon" replay "$log" --initializer "$initializer" --out "$out/$initializer" || status=$?
  fi
  ((status <= 1)) || return "$status"
  runs+=("$out/$initializer")
}

runs=()
default=etalon
announce "Replay the rawlog with the default initializer, $default"
replay "$default"

announce "Replay it with the others (what they print: $out/INITIALIZER.txt)"
for initializer in "${initializers[@]}"; do
  [[ $initializer != "$default" ]] || continue
  report=$out/$initializer.txt
  if is_done "$out/$initializer/config.ini" "$log"; then
    replay "$initializer"
    continue
  fi
  replay "$initializer" >"$report" 2>&1 || { status=$?; cat "$report"; exit "$status"; }
  grep "^$initializer " "$report" || tail -n 1 "$report"
done

announce "Compare the runs"
run "$etalon" compare "${runs[@]}" --save-plot "$out/runs.png" | tee "$out/comparison.txt"

announce "What was written"
printf '%s\n' \
  "$flight  the recording, a EuRoC folder" \
  "$log  the same as an MRPT rawlog" \
  "$out/comparison.txt  the table above" \
  "$out/runs.png  all trajectories in one picture"
for file in "${runs[0]}"/*; do
  case "$file" in
    *.png) meaning="picture: the trajectory from above, errors over time" ;;
    *.html) meaning="report: the flight, its states, its errors beside the predicted ones, for a browser" ;;
    *_smoothed.tum) meaning="the same, each pose as it was last known" ;;
    *.3Dscene) meaning="the flight in three dimensions (SceneViewer3D)" ;;
    *.tum) meaning="trajectory T_WB, TUM format" ;;
    *.json) meaning="every attempt: status, states, biases, errors" ;;
    *.rawlog) meaning="the run as MRPT observations (RawLogViewer)" ;;
    *.ini) meaning="the effective configuration" ;;
    *.csv) meaning="every frame: state, velocity, biases, standard deviations" ;;
    *) meaning="" ;;
  esac
  printf '%s  %s\n' "$file" "$meaning"
done
echo "$out/INITIALIZER/...  the same of every other initializer"
