#!/usr/bin/env bash
# Runs the benchmarks of docs/results.md and writes that document from what they give.
#
#   scripts/make_results.sh OUT GROUP...
#
# A GROUP is a folder of recordings (EuRoC folders or .rawlog files); its name becomes a chapter. For every
# group all initializers are tried on windows of 10 and 5 keyframes at 4 and 10 Hz; then, with config/paper.ini,
# ORB-SLAM3's and ETA's on the papers' window. Results stay in OUT/<group> and OUT/<group>_paper; a second
# call goes on where the first one ended. Numbers that stand in docs/results.md all come from there.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
etalon=$root/build/release/bin/etalon
(($# >= 2)) || { sed -n '2,10p' "${BASH_SOURCE[0]}" | sed 's/^# \{0,1\}//' >&2; exit 2; }
[[ -x $etalon ]] || { echo "make_results.sh: $etalon is missing; run scripts/build.sh" >&2; exit 2; }
out=$1
shift
mkdir -p "$out"
document=$root/docs/results.md
part=$out/results.md.part

# Blocks of the Markdown that `etalon compare` prints, chosen by a pattern of their titles.
blocks() {
  awk -v pattern="$2" '
    function flush() { if (text != "" && title ~ pattern) printf "%s", text; text = "" }
    /^\*\*/ { flush(); title = $0 }
    { text = text $0 "\n" }
    END { flush() }' "$1"
}

# Our figures beside the published ones, for the sequences that the paper has.
beside_the_paper() { # summary with our configuration, summary with config/paper.ini, error, factor, unit
  awk -F, -v error="$3" -v factor="$4" -v unit="$5" '
    FNR == 1 { ++file }
    file == 1 {
      if ($0 ~ /^#/) next
      if ($1 == "sequence") { for (i = 1; i <= NF; ++i) paper[i] = $i; next }
      names[++count] = $1
      for (i = 2; i <= NF; ++i) published[$1, paper[i]] = $i
      next
    }
    FNR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
    $column["keyframes"] == 10 && $column["rate_hz"] == 4 && $column["slots"] == "all" {
      key = file SUBSEP $1 SUBSEP $column["initializer"] SUBSEP $column["stage"]
      mean[key] = $column[error "_mean"]; median[key] = $column[error "_median"]; known[$1] = 1
    }
    function pair(file, name, initializer, stage,   key) {
      key = file SUBSEP name SUBSEP initializer SUBSEP stage
      return (key in mean) ? sprintf("%.3f / %.3f", factor * mean[key], factor * median[key]) : "-"
    }
    END {
      short = error; sub(/_.*/, "", short)
      printf "| %s | stage | paper: ORB-SLAM3 | ours, paper.ini | paper: ETA | ours, paper.ini | ours, defaults |\n", unit
      printf "|---|---|---|---|---|---|---|\n"
      for (n = 1; n <= count; ++n) {
        name = names[n]
        if (!(name in known)) continue
        for (s = 1; s <= 2; ++s) {
          stage = s == 1 ? "init" : "vi_ba"
          printf "| %s | %s | %s | %s | %s | %s | %s |\n", name, s == 1 ? "without VI-BA" : "with",
            published[name, short "_orbslam3_" stage], pair(3, name, "orbslam3_inertial_only", stage),
            published[name, short "_eta_" stage], pair(3, name, "eta", stage), pair(2, name, "eta", stage)
        }
      }
    }' "$root/docs/data/eta_paper.csv" "$1" "$2"
}

cat >"$part" <<'HEAD'
# Results

Written by `scripts/make_results.sh`, whose commands stand above the tables; nothing here was typed by hand. What to make of it:
[conclusions.md](conclusions.md). What the columns mean: [evaluation.md](evaluation.md).
HEAD

for group in "$@"; do
  name=$(basename "$group")
  recordings=("$group"/*)
  echo "results: $name, ${#recordings[@]} recordings" >&2
  # Exit code 3: a recording could not be used; the table of the others is still wanted, and the document says so.
  status=0
  "$etalon" bench "${recordings[@]}" --keyframes 10,5 --rate 4,10 --tracks "$out/tracks" --out "$out/$name" >"$out/$name.txt" || status=$?
  ((status == 0 || status == 3)) || exit "$status"
  "$etalon" bench "${recordings[@]}" --initializers eta,orbslam3_inertial_only -c "$root/config/paper.ini" \
    --tracks "$out/tracks" --out "$out/${name}_paper" >"$out/${name}_paper.txt" || status=$?
  ((status == 0 || status == 3)) || exit "$status"
  "$etalon" compare "$out/$name" --format markdown >"$out/$name.md"
  "$etalon" compare "$out/${name}_paper" --format markdown >"$out/${name}_paper.md"
  {
    printf '\n## %s\n\n    $ etalon bench %s/* --keyframes 10,5 --rate 4,10 --out %s\n\n' "$name" "$name" "$name"
    ((status == 0)) || printf 'Some recordings could not be used: see the end of the output.\n\n'
    printf '### 10 keyframes at 4 Hz, the papers'"'"' window\n\n'
    blocks "$out/$name.md" '(Success|refused|RRE.*median|RRE.*mean|ATE.*median|ATE.*mean|Gravity.*median|Velocity.*median|[Gg]yro.*median|[Rr]un time).*10 keyframes at 4 Hz'
    printf '### Other windows\n\n'
    blocks "$out/$name.md" '(Success|RRE.*median|ATE.*median|Velocity.*median).*(5 keyframes at|10 keyframes at 10)'
    printf '### Noise and ground truth\n\n'
    blocks "$out/$name.md" '([Nn]oise.*10 keyframes at 4 Hz|[Ff]loor)'
    printf '### Which differences are significant?\n\n'
    blocks "$out/$name.md" '([Dd]ifference|[Bb]ootstrap).*10 keyframes at 4 Hz'
    if grep -qE '^(MH|V[12])_[0-9]*_(easy|medium|difficult),' "$out/$name/summary.csv"; then
      printf '### Beside the published figures\n\n    $ etalon bench %s/* --initializers eta,orbslam3_inertial_only -c config/paper.ini --out %s_paper\n\n' "$name" "$name"
      printf 'Ours as mean / median over all slots; `config/paper.ini` has the papers'"'"' noise and priors.\n\n'
      beside_the_paper "$out/$name/summary.csv" "$out/${name}_paper/summary.csv" rre_deg 1 'RRE [deg]'
      printf '\n'
      beside_the_paper "$out/$name/summary.csv" "$out/${name}_paper/summary.csv" ate_m 1 'ATE [m]'
      printf '\n'
    fi
    printf '### With the papers'"'"' noise and priors\n\n'
    blocks "$out/${name}_paper.md" '(Success|RRE.*median|ATE.*median|Gravity.*median|Velocity.*median)'
  } >>"$part"
done
mv "$part" "$document"
echo "results: wrote $document" >&2
