#!/usr/bin/env bash
# What the map is worth: both odometries on recordings, the fixed-lag one without and with its map, from cached tracks (a benchmark's
# --tracks) and the true state 5 s after the first image. Prints a Markdown table.
#
#   scripts/measure_map.sh TRACKS SRC...
#
# odometry_accuracy is built with -DETALON_BUILD_BENCHMARKS=ON. A recording of less than 10 s is flown from its beginning.
# Exit code 1 if a flight failed; its message is on standard error.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
[[ $# -ge 2 ]] || { sed -n '2,8p' "$0"; exit 2; }
program=$here/build/release/bin/odometry_accuracy
[[ -x $program ]] || { echo "measure_map.sh: $program is missing; build with -DETALON_BUILD_BENCHMARKS=ON" >&2; exit 2; }
tracks=$1
shift

# ATE in SE(3), in yaw and position, roll and pitch, velocity, scale, NEES of the position, of a line of odometry_accuracy.
row() {
  awk -F ' *[|] *' -v odometry="$1" '$1 == odometry { split($NF, nees, " "); printf "%s|%s|%s|%s|%s|%s", $2, $3, $6, $8, $9, nees[2]; found = 1 }
    END { if (!found) printf "failed|||||" }'
}

printf '| recording | stereo odometry: ATE, m | in yaw and position | without the map: ATE, m | in yaw and position | with it: ATE, m | in yaw and position | roll and pitch, deg | velocity, m/s | scale, %% | NEES of the position |\n'
printf '|---|---|---|---|---|---|---|---|---|---|---|\n'
status=0
for source in "$@"; do
  from=5
  [[ $(wc -l <"$source/mav0/cam0/data.csv") -gt 201 ]] || from=0
  fly() { "$program" "$source" --tracks "$tracks" --from "$from" "$@"; }
  plain=$(fly) || status=1
  mapped=$(fly --stereo no --map yes) || status=1
  IFS='|' read -r stereo stereo_yaw _ <<<"$(row stereo <<<"$plain")"
  IFS='|' read -r without without_yaw _ <<<"$(row 'fixed lag' <<<"$plain")"
  IFS='|' read -r with with_yaw tilt velocity scale nees <<<"$(row 'fixed lag' <<<"$mapped")"
  printf '| %s | %s | %s | %s | %s | %s | %s | %s | %s | %s | %s |\n' "$(basename "$source")" "$stereo" "$stereo_yaw" "$without" "$without_yaw" \
    "$with" "$with_yaw" "${tilt//-nan/–}" "$velocity" "$scale" "$nees"
done
exit "$status"
