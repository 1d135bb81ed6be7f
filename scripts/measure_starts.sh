#!/usr/bin/env bash
# Starts the pipeline at many instants of a recording, with each initializer, and prints the medians of the errors before
# and after VI-BA, and how many first attempts, at whole windows, were accepted and good (gravity < 2 deg and velocity < 0.1 m/s).
#
#   scripts/measure_starts.sh SRC "0 1 2 3 4" [INITIALIZER...]      -- further options of replay after a bare --
#   e.g. scripts/measure_starts.sh /data/MH_01_easy "0 2.5 5 7.5" eta orbslam3_inertial_only
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
[[ $# -ge 2 ]] || { sed -n '2,7p' "$0"; exit 2; }
etalon=${ETALON_BINARY:-$here/build/release/bin/etalon}
source=$1 starts=$2
shift 2
initializers=()
while [[ $# -gt 0 && $1 != -- ]]; do initializers+=("$1"); shift; done
[[ ${1:-} == -- ]] && shift
((${#initializers[@]})) || mapfile -t initializers < <("$etalon" plugins --ini | sed -nE 's/^\[(.+)\]$/\1/p')

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for initializer in "${initializers[@]}"; do
  runs=()
  for from in $starts; do
    out=$work/$initializer/$from
    # Four seconds hold the window and a few further attempts.
    "$etalon" replay "$source" --initializer "$initializer" --from "$from" \
      --to "$(awk "BEGIN{print $from + 4}")" --set pipeline.min_keyframes=200 --out "$out" "$@" >"$work/log" 2>&1 || [[ $? -eq 1 ]] || {
      cat "$work/log" >&2
      exit 1
    }
    runs+=("$out")
  done
  "$etalon" compare --format csv "${runs[@]}" >"$work/$initializer.csv"
  awk -F, -v name="$initializer" -v starts="${#runs[@]}" '
    function median(list, n,   i, j, v, sorted) {
      for (i = 1; i <= n; i++) sorted[i] = list[i]
      for (i = 2; i <= n; i++) { v = sorted[i]; for (j = i - 1; j > 0 && sorted[j] > v; j--) sorted[j + 1] = sorted[j]; sorted[j + 1] = v }
      return n ? (n % 2 ? sorted[(n + 1) / 2] : (sorted[n / 2] + sorted[n / 2 + 1]) / 2) : "nan"
    }
    NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; next }
    {
      stage = $at["stage"]; k = ++count[stage]
      rre[stage, k] = $at["rre_deg"]; ate[stage, k] = 1000 * $at["ate_m"]; v[stage, k] = $at["velocity_mps"]
      g[stage, k] = $at["gravity_deg"]; ms[stage, k] = $at["ms"]
      if ($at["attempts"] == 1 && $at["status"] == "success" && $at["gravity_deg"] < 2 && $at["velocity_mps"] < 0.1) ++good[stage]
    }
    function column(values, stage,   i, n, list) { n = count[stage]; for (i = 1; i <= n; i++) list[i] = values[stage, i]; return median(list, n) }
    END {
      split("init vi_ba", stages, " ")
      for (s = 1; s <= 2; s++) {
        stage = stages[s]
        printf "%-24s %-6s success %d/%d  median: RRE %.4f deg  ATE %.2f mm  velocity %.4f m/s  gravity %.2f deg  %.2f ms\n", \
          name, stage, good[stage], starts, column(rre, stage), column(ate, stage), column(v, stage), column(g, stage), column(ms, stage)
      }
    }' "$work/$initializer.csv"
done
