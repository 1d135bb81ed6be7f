#!/usr/bin/env bash
# Starts the odometry at several instants of recordings with each initializer and flies to the end, from cached tracks (a benchmark's
# --tracks); prints for each initializer how many starts fly to the end, and the median and the largest ATE over the starts, m.
#
#   scripts/measure_offsets.sh TRACKS "10 12 14" SRC... [-- INITIALIZER...]
#
# odometry_accuracy is built with -DETALON_BUILD_BENCHMARKS=ON.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
[[ $# -ge 3 ]] || { sed -n '2,7p' "$0"; exit 2; }
tracks=$1 offsets=$2
shift 2
sources=()
while [[ $# -gt 0 && $1 != -- ]]; do sources+=("$1"); shift; done
[[ ${1:-} == -- ]] && shift
initializers=("$@")
((${#initializers[@]})) || initializers=(etalon eta orbslam3_inertial_only stereo_nec drt vins_alignment joint_closed_form)
printf '| recording | initializer | starts | to the end | ATE, m: median | largest | largest over median |\n|---|---|---|---|---|---|---|\n'
for source in "${sources[@]}"; do
  for initializer in "${initializers[@]}"; do
    for from in $offsets; do
      "$here/build/release/bin/odometry_accuracy" "$source" --tracks "$tracks" --from "$from" --start "$initializer" --stereo no 2>&1 |
        awk -F '|' '/^fixed lag/ { print $2 + 0; found = 1 } END { if (!found) print "failed" }'
    done | sort -g | awk -v row="| $(basename "$source") | \`$initializer\`" '
      { ++starts }
      $1 != "failed" { ate[++flown] = $1 }
      END {
        median = flown % 2 ? ate[(flown + 1) / 2] : (ate[flown / 2] + ate[flown / 2 + 1]) / 2
        printf "%s | %d | %d | %.4f | %.4f | %.2f |\n", row, starts, flown, median, ate[flown], ate[flown] / median
      }'
  done
done
