#!/usr/bin/env bash
# False accepts against refusals: windows of recordings that grow until a start is accepted (etalon bench --grow), for several
# confidences at which GRAVITY deg, VELOCITY m/s are wanted. A line a confidence: windows that were accepted, of these how many are
# off by more than was wanted, and how many are outside 3.5 standard deviations of their own covariance or no success (gravity < 2 deg, velocity
# < 0.1 m/s); windows that were refused although the last estimate was as good as wanted; the median length of the accepted windows, s.
# OUT/curve.svg plots what was accepted wrongly, and the false accepts, over what was refused without need.
#
#   scripts/measure_acceptance.sh OUT TRACKS INITIALIZER GRAVITY VELOCITY "0.5 0.9 0.99" SRC... [-- OPTIONS OF BENCH]
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
etalon=${ETALON_BINARY:-$here/build/release/bin/etalon}
[[ $# -ge 7 ]] || { sed -n '2,8p' "$0"; exit 2; }
out=$1 tracks=$2 initializer=$3 gravity=$4 velocity=$5 confidences=$6
shift 6
sources=()
while [[ $# -gt 0 && $1 != -- ]]; do sources+=("$1"); shift; done
[[ ${1:-} == -- ]] && shift
mkdir -p "$out"
rows=$(
printf '| confidence | windows | accepted | of these worse than wanted | false accepts | good but refused | window, s |\n|---|---|---|---|---|---|---|\n'
for confidence in $confidences; do
  run=$out/${initializer}_${gravity}_${velocity}_$confidence
  "$etalon" bench "${sources[@]}" --grow --initializers "$initializer" --tracks "$tracks" --out "$run" --overwrite \
    --set acceptance.gravity_deg="$gravity" --set acceptance.velocity_mps="$velocity" --set acceptance.confidence="$confidence" \
    "$@" >"$run.log" 2>&1 || { cat "$run.log" >&2; exit 1; }
  # Reasons are quoted and may hold commas.
  sed 's/"[^"]*"//g' "$run/windows.csv" | awk -F, -v confidence="$confidence" -v gravity="$gravity" -v velocity="$velocity" '
    NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; next }
    $at["stage"] != "vi_ba" { next }
    {
      ++windows
      if ($at["gravity_deg"] == "") next
      good = $at["gravity_deg"] < gravity && $at["velocity_mps"] < velocity
      if ($at["status"] != "success") { refused += good; next }
      seconds[++accepted] = $at["window_s"]
      worse += !good
      # 3.5 standard deviations: chi-square of 2 and 3 degrees of freedom at 4.65e-4.
      false_accepts += $at["gravity_deg"] >= 2 || $at["velocity_mps"] >= 0.1 || 2 * $at["tilt_nees"] > 15.35 ||
        3 * $at["velocity_nees"] > 17.89 || 3 * $at["accel_bias_nees"] > 17.89
    }
    END {
      for (i = 2; i <= accepted; i++) { v = seconds[i]; for (j = i - 1; j > 0 && seconds[j] > v; j--) seconds[j + 1] = seconds[j]; seconds[j + 1] = v }
      printf "| %s | %d | %d | %d | %d | %d | %.2f |\n", confidence, windows, accepted, worse, false_accepts, refused, seconds[int((accepted + 1) / 2)]
    }'
done
)
echo "$rows"

awk -F '|' -v wanted="$gravity deg, $velocity m/s" '
  function line(share, colour,   i) {
    printf "<polyline fill=\"none\" stroke=\"%s\" stroke-width=\"2\" points=\"", colour
    for (i = 1; i <= n; i++) printf "%.1f,%.1f ", 60 + 4.5 * refused[i], 310 - 270 * share[i] / top
    print "\"/>"
    for (i = 1; i <= n; i++)
      printf "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"4\" fill=\"%s\"/>\n", 60 + 4.5 * refused[i], 310 - 270 * share[i] / top, colour
  }
  NR > 2 {
    name[++n] = $2 + 0; worse[n] = 100 * $5 / $3; wrong[n] = 100 * $6 / $3; refused[n] = 100 * $7 / $3
    top = top > worse[n] ? top : worse[n]; top = top > wrong[n] ? top : wrong[n]
  }
  END {
    top = top > 0 ? 1.15 * top : 1
    print "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"560\" height=\"360\" font-family=\"sans-serif\" font-size=\"12\">"
    print "<rect width=\"560\" height=\"360\" fill=\"white\"/>"
    for (i = 0; i <= 5; i++) {
      x = 60 + 90 * i; y = 310 - 54 * i
      printf "<path d=\"M%d 310V40M60 %dH510\" stroke=\"#ddd\"/>", x, y
      printf "<text x=\"%d\" y=\"328\" text-anchor=\"middle\">%d</text>", x, 20 * i
      printf "<text x=\"54\" y=\"%d\" text-anchor=\"end\">%.1f</text>\n", y + 4, top * i / 5
    }
    line(worse, "#1f77b4")
    line(wrong, "#d62728")
    for (i = 1; i <= n; i++) {
      x = 60 + 4.5 * refused[i]; y = 310 - 270 * worse[i] / top
      above = i > 1 && refused[i] == refused[i - 1] && worse[i] == worse[i - 1] ? above + 13 : 6
      printf "<text x=\"%.1f\" y=\"%.1f\">%g</text>\n", x + 7, y - above, name[i]
    }
    print "<text x=\"500\" y=\"60\" text-anchor=\"end\" fill=\"#1f77b4\">accepted, but worse than wanted</text>"
    print "<text x=\"500\" y=\"76\" text-anchor=\"end\" fill=\"#d62728\">false accepts</text>"
    print "<text x=\"285\" y=\"350\" text-anchor=\"middle\">as good as wanted (" wanted "), but refused, % of the windows</text>"
    print "<text transform=\"translate(18 175) rotate(-90)\" text-anchor=\"middle\">% of the windows</text>"
    print "<text x=\"285\" y=\"24\" text-anchor=\"middle\" font-size=\"14\">Acceptance by prediction, by confidence</text>"
    print "</svg>"
  }' <<<"$rows" >"$out/curve.svg"
