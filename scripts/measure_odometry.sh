#!/usr/bin/env bash
# Replays recordings and prints the odometry's errors over the whole run, from the first image on, as a Markdown table: the causal
# trajectory, the smoothed one and, with --final-ba among the options, the final one. Faults and many starts: etalon trial.
#
#   scripts/measure_odometry.sh OUT SRC... [-- OPTIONS OF REPLAY]
#
# OUT keeps the runs; those that are complete are not made again.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
etalon=${ETALON_BINARY:-$here/build/release/bin/etalon}
[[ $# -ge 2 ]] || { sed -n '2,7p' "$0"; exit 2; }
out=$1
shift
sources=()
while [[ $# -gt 0 && $1 != -- ]]; do sources+=("$1"); shift; done
[[ ${1:-} == -- ]] && shift
final_column=""
for option in "$@"; do [[ $option == --final-ba ]] && final_column=yes; done

# RMSE of the position, m, after alignment in SE(3) and in yaw and position, and of the rotation after the latter, deg.
errors() {
  "$etalon" evaluate --format csv --min-coverage 0.1 "$1" "$2" |
    awk -F, '$1 == "ATE" { rmse[$2] = $4; rotation[$2] = $10 }
             END { printf "%.4f | %.4f | %.3f", rmse["SE(3)"], rmse["yaw and position"], rotation["yaw and position"] }'
}

mkdir -p "$out"
printf '| recording | ATE, m | in yaw and position | rotation, deg | smoothed | in yaw and position | rotation, deg | %sframes | ms a frame | states after the start |\n' \
  "${final_column:+final | in yaw and position | rotation, deg | }"
printf '|---|---|---|---|---|---|---|---|---|---|%s\n' "${final_column:+---|---|---|}"
for source in "${sources[@]}"; do
  name=$(basename "$source")
  run=$out/$name
  if [[ ! -e $run/row ]]; then
    "$etalon" replay "$source" --out "$run" "$@" >"$out/$name.log" 2>&1 || [[ $? -eq 1 ]] || { cat "$out/$name.log" >&2; exit 1; }
    causal=$(errors "$run/trajectory.tum" "$source")
    smoothed=$(errors "$run/trajectory_smoothed.tum" "$source")
    final=""
    if [[ -n $final_column ]]; then final="$(errors "$run/trajectory_final.tum" "$source") | "; fi
    awk -v row="| $name | $causal | $smoothed | $final" '
      /"stereo_frames"/ { frames = $2 + 0 }
      /"frame_median_ms"/ { ms = $2 + 0 }
      /"state":/ { gsub(/[",]/, "", $2); state = $2 }
      /"remark": false/ { states = states (states ? ", " : "") state }
      /"reason":/ && remarked { sub(/^ *"reason": "/, ""); sub(/",?$/, ""); remarks = remarks "; " $0 }
      { remarked = /"remark": true/ }
      END {
        sub(/^(waiting, )?visual, inertial(, )?/, "", states)
        printf "%s %d | %.1f | %s%s |\n", row, frames, ms, states ? states : "inertial", remarks
      }
    ' "$run/initialization.json" >"$run/row.part"
    mv "$run/row.part" "$run/row"
  fi
  cat "$run/row"
done
