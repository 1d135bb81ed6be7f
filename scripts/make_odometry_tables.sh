#!/usr/bin/env bash
# Measures the tables of docs/odometry_results.md and docs/trial.md: OUT/TABLE.md each. About two hours on two cores for all of them; an
# interrupted call goes on.
#
#   scripts/make_odometry_tables.sh RECORDINGS OUT [TABLE]...
#
# TABLE: whole (runs by default, with the final adjustment), faults (a grid of them), starts (twelve by every initializer, to the end: more than an hour),
# first_seconds (what a better start buys), survival (the shipped faults over the seven recordings), losses (seconds
# without images, and back to where it was or not); without: all of them.
# RECORDINGS has, made by render_sequence, MH_01_easy, MH_03_medium, MH_04_difficult, V1_01_easy, V1_02_medium, V2_01_easy and
# V2_02_medium with seed 1, those of docs/odometry_results.md ("Whole recordings", "Without images"), and MH_01_easy_real.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
[[ $# -ge 2 && $1 != -* ]] || { sed -n '2,11p' "$0"; exit 2; }
etalon=${ETALON_BINARY:-$here/build/release/bin/etalon}
mkdir -p "$2"
recordings=$(realpath "$1") out=$(realpath "$2")
shift 2
tables=("$@")
((${#tables[@]})) || tables=(whole faults starts first_seconds survival losses)
seven=(MH_01_easy MH_03_medium MH_04_difficult V1_01_easy V1_02_medium V2_01_easy V2_02_medium)
cd "$recordings"

trial() { # TABLE option...
  local table=$1 code=0
  shift
  "$etalon" trial "$@" --out "$out/$table" --format markdown || code=$?
  # 4: a run crashed or used up its time, which its table counts; all else is done.
  ((code == 0 || code == 4)) || exit "$code"
}

whole() {
  "$here/scripts/measure_odometry.sh" "$out/whole" V1_02_s7 MH_04_s10 V2_02_s8 V2_02_hard_s11 MH_01_easy_real -- --final-ba
}
faults() {
  trial faults V1_02_s7 MH_04_s10 --starts 3 --seconds 20 --faults "$here/config/fault_grid.ini"
}
starts() {
  local from=10,12,14,16,18,20,22,24,26,28,30,32
  trial starts V1_02_s7 MH_04_s10 --from $from --seconds 0 --initializers all
}
# A recording after the other, each with the device file of all others.
first_seconds() {
  local name
  for name in "${seven[@]}"; do
    mkdir -p "$out/without_$name"
    "$etalon" calibrate-device --base "$here/config/devices/euroc.ini" --without "$name" --out "$out/without_$name/known.ini" >/dev/null
    trial "first_seconds_$name" "$name" --starts 12 --settings soon:pipeline.initializer=etalon --settings later:pipeline.min_keyframes=10 \
      --settings "$out/without_$name/known.ini" |
      sed -n "/^.*What the start is worth/,/^.*By recording/ s/^| \(what flew\|---*\|soon\|later\|known\)/| $name &/p"
  done
}
survival() {
  trial survival "${seven[@]}" --starts 3 --faults "$here/config/faults.ini"
}
losses() {
  trial losses MH_01_s23 MH_03_s22 MH_04_s10 V1_02_s24 V2_01_s21 V2_02_hard_s11 --from 10,30 --seconds 45 \
    --faults "$here/config/losses.ini" --settings back:map.relocalize=true --settings stays:map.relocalize=false \
    --settings lost_after_5s:odometry.max_dead_reckoning_s=5 --ate-limit 20
}

for table in "${tables[@]}"; do
  case "$table" in
    whole | faults | starts | first_seconds | survival | losses) ;;
    *)
      echo "make_odometry_tables.sh: unknown table '$table'; expected whole, faults, starts, first_seconds, survival or losses" >&2
      exit 2
      ;;
  esac
done
for table in "${tables[@]}"; do
  echo "tables: $table"
  "$table" >"$out/$table.md"
done
