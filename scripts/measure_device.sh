#!/usr/bin/env bash
# Prints what a device file is worth, recording by recording left out of it: windows of one second by `etalon`, without VI-BA,
# cold and with the flights of all other recordings. A recording NAME_real is a part of NAME. Errors are medians / 90th percentiles
# (worst), NEES per degree of freedom means, "beyond" the windows whose tilt or b_a is outside of 3.5 sigma. Then how far the flights'
# biases are from the means of the recordings' ground truth.
#
#   scripts/measure_device.sh OUT DEVICE.ini SRC...    -- OUT keeps tracks, device files and results
#   INITIALIZER=etalon KEYFRAMES=5 EVERY=2.5           -- 5 keyframes at 4 Hz are a second, 10 are 2.25
#   TRUTH=FOLDER                                       -- of `etalon ground-truth`, in place of the recordings' own
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
[[ $# -ge 3 ]] || { sed -n '2,9p' "$0"; exit 2; }
etalon=${ETALON_BINARY:-$here/build/release/bin/etalon}
out=$1 device=$2
shift 2
truth_option=(${TRUTH:+--ground-truth "$TRUTH"})
mkdir -p "$out"

bench() { # SRC RESULT option...
  local source=$1 result=$2
  shift 2
  "$etalon" bench "$source" --initializers "${INITIALIZER:-etalon}" --keyframes "${KEYFRAMES:-5}" --every "${EVERY:-2.5}" --vi-ba off \
    --tracks "$out/tracks" --out "$result" --overwrite --format csv "${truth_option[@]}" "$@" >/dev/null 2>"$result.log" || { cat "$result.log" >&2; exit 1; }
}

for source in "$@"; do
  name=$(basename "$source")
  flight=${name%_real}
  if grep -q "^$flight = " "$device"; then
    "$etalon" calibrate-device --base "$device" --without "$flight" --out "$out/without_$name.ini" >/dev/null
  else
    cp "$device" "$out/without_$name.ini"
  fi
  bench "$source" "$out/cold_$name"
  bench "$source" "$out/known_$name" -c "$out/without_$name.ini"
done

for case in cold known; do
  for source in "$@"; do
    sed "s/^/$case,/" "$out/${case}_$(basename "$source")/windows.csv"
  done
done | awk -F, '
  function sorted(values, n, result,   i, j) {
    for (i = 1; i <= n; i++) {
      for (j = i - 1; j >= 1 && result[j] > values[i]; j--) result[j + 1] = result[j]
      result[j + 1] = values[i]
    }
  }
  function at(q, n,   p, i) { p = 1 + q * (n - 1); i = int(p); return i >= n ? s[n] : s[i] + (p - i) * (s[i + 1] - s[i]) }
  function load(key, column,   n, i) {
    n = good[key]
    split("", s); split("", v)
    for (i = 1; i <= n; i++) v[i] = value[key, column, i]
    sorted(v, n, s)
    return n
  }
  function of(field) { return $(column[field]) * (field == "ate_m" ? 1000 : 1) }
  function median(key, column, format,   n) { n = load(key, column); return sprintf(format " / " format, at(0.5, n), at(0.9, n)) }
  function add(key,   field, i) {
    if (!(key in count)) order[++keys] = key
    count[key]++
    if ($(column["status"]) != "success") return
    i = ++good[key]
    for (field in wanted) {
      value[key, field, i] = of(field)
      sum[key, field] += of(field)
    }
    if (of("gravity_deg") < 2 && of("velocity_mps") < 0.1) success[key]++
    # Chi-squares of 2 and 3 degrees of freedom at 4.65e-4, as improbable as 3.5 sigma of one.
    if (2 * of("tilt_nees") > 15.35 || 3 * of("accel_bias_nees") > 17.89) beyond[key]++
  }
  BEGIN {
    split("rre_deg ate_m gravity_deg velocity_mps accel_bias_mps2 tilt_nees velocity_nees accel_bias_nees", fields, " ")
    for (f in fields) wanted[fields[f]]
  }
  $2 == "sequence" {
    for (c = 1; c <= NF; c++) column[$c] = c
    for (field in wanted) if (!(field in column)) { print "windows.csv has no column " field; exit 1 }
    next
  }
  { add($1 "," $2); if ($2 !~ /_real$/) add($1 ",all but _real") }
  END {
    printf "%-6s %-16s %12s %16s %11s %26s %18s %18s %6s %9s %6s %7s\n", "prior", "recording", "success", "RRE, deg", "ATE, mm", \
      "gravity, deg", "velocity, m/s", "b_a, m/s^2", "tilt", "velocity", "b_a", "beyond"
    for (k = 1; k <= 2 * keys; k++) {  # all of them last
      key = order[k <= keys ? k : k - keys]
      if ((key ~ /,all/) != (k > keys)) continue
      split(key, name, ",")
      n = load(key, "gravity_deg"); gravity = sprintf("%.3f / %.3f (%.2f)", at(0.5, n), at(0.9, n), s[n])
      printf "%-6s %-16s %5d of %3d %16s %11s %26s %18s %18s %6.2f %9.2f %6.2f %7d\n", name[1], name[2], success[key], count[key], \
        median(key, "rre_deg", "%.4f"), median(key, "ate_m", "%.2f"), gravity, median(key, "velocity_mps", "%.4f"), \
        median(key, "accel_bias_mps2", "%.3f"), sum[key, "tilt_nees"] / n, sum[key, "velocity_nees"] / n, sum[key, "accel_bias_nees"] / n, \
        beyond[key]
    }
  }'

printf '\n%-16s %27s %27s\n' "flight" "b_g off, 1e-5 rad/s (sigma)" "b_a off, m/s^2 (sigma)"
for source in "$@"; do
  truth=${TRUTH:+$TRUTH/$(basename "$source")/data.csv}
  truth=${truth:-$source/mav0/state_groundtruth_estimate0/data.csv}
  flight=$(grep "^$(basename "$source") = " "$device") || continue
  [[ -f $truth ]] || continue
  awk -v flight="$flight" '
    BEGIN {
      FS = ","
      split(flight, part, " ")  # name = first last | mean, sigma, wander | mean, sigma, wander
      for (a = 1; a <= 3; a++) {
        mean[a] = part[5 + a]; sigma[a] = part[8 + a]
        mean[3 + a] = part[13 + a]; sigma[3 + a] = part[16 + a]
      }
    }
    !/^#/ && $1 + 0 >= part[3] + 0 && $1 + 0 <= part[4] + 0 { n++; for (a = 1; a <= 6; a++) sum[a] += $(11 + a) }
    END {
      for (a = 1; a <= 6; a++) off[a] = mean[a] - sum[a] / n
      printf "%-16s", part[1]
      for (a = 1; a <= 3; a++) printf " %5.1f (%.1f)", 1e5 * off[a], 1e5 * sigma[a]
      for (a = 4; a <= 6; a++) printf " %7.4f (%.4f)", off[a], sigma[a]
      printf "\n"
    }' "$truth"
done | awk '{ print; for (a = 1; a <= 3; a++) { g += $(2 * a) ^ 2; b += $(6 + 2 * a) ^ 2; n++ } }
  END { if (n) printf "%-16s %.1f and %.4f\n", "RMS of an axis", sqrt(g / n), sqrt(b / n) }'
