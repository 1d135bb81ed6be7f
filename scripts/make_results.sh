#!/usr/bin/env bash
# Runs the benchmarks of docs/results.md and writes that document, a summary, from what they give; the long tables are
# CSV in docs/results.
#
#   scripts/make_results.sh OUT GROUP[:EVERY[:KEYFRAMES:RATES[:JOBS]]]...
#
# A GROUP is a folder of recordings (EuRoC folders or .rawlog files); its name becomes a chapter, and about.txt in it,
# if there is one, says in the chapter how they were made. EVERY are the seconds from window to window (2.5), KEYFRAMES and
# RATES their shapes (10,5 and 4,10), JOBS the threads (2; run times are true to a quiet machine with 1 only). For every
# group all initializers are tried; then, with config/paper.ini, ORB-SLAM3's and ETA's on the papers' windows. Results
# stay in OUT/<group> and OUT/<group>_paper; a second call goes on where the first one ended, and prints the tables of a
# benchmark that is complete anew, whatever program made it; EVERY, KEYFRAMES and RATES must be those that it was made with.
# Numbers that stand in docs/results.md all come from there.
# shellcheck disable=SC2016 # the backticks are Markdown's
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
etalon=$root/build/release/bin/etalon
compared=success,rre_deg,ate_m,velocity_mps,gravity_deg
initializers=eta,orbslam3_inertial_only,stereo_nec,vi_orb,edi,huang_stereo,kneip,drt,vins_alignment,joint_mle,joint_closed_form,etalon,static
(($# >= 2)) || { sed -n '2,13p' "${BASH_SOURCE[0]}" | sed 's/^# \{0,1\}//' >&2; exit 2; }
[[ -x $etalon ]] || { echo "make_results.sh: $etalon is missing; run scripts/build.sh" >&2; exit 2; }
out=$1
shift
mkdir -p "$out" "$root/docs/results"
document=$root/docs/results.md
part=$out/results.md.part

# Tables of the Markdown that `etalon compare` prints, chosen by a pattern of their titles, without their notes.
tables() {
  awk -v pattern="$2" '
    /^\*\*/ { title = $0; chosen = title ~ pattern; if (chosen) printf "%s\n\n", title; next }
    /^[|]/ && chosen { gsub(/ +/, " "); gsub(/---+/, "---"); print; rows = 1; next }  # nobody reads it as text
    chosen && rows { print ""; chosen = rows = 0 }
    END { if (chosen && rows) print "" }' "$1"
}

# A CSV table in docs/results, numbers with four digits. Of a summary's other shapes the rows over all recordings are enough.
keep() { # name; CSV on standard input
  awk -F, -v OFS=, '
    NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; print; next }
    "windows" in column && ($column["keyframes"] != 10 || $column["rate_hz"] != 4) && $column["sequence"] != "all" { next }
    { for (i = 1; i <= NF; ++i) if ($i ~ /^-?[0-9.]+(e[-+]?[0-9]+)?$/ && $i ~ /[.e]/) $i = sprintf("%.4g", $i); print }' >"$root/docs/results/$1.csv"
}

# Our figures beside the published ones (deg; m, printed as mm), for the sequences that the paper has.
beside_the_paper() { # summary with our configuration, summary with config/paper.ini, error, factor, unit
  awk -F, -v error="$3" -v factor="$4" -v unit="$5" '
    FNR == 1 { ++file }
    file == 1 {
      if ($0 ~ /^#/) next
      if ($1 == "sequence") { for (i = 1; i <= NF; ++i) paper[i] = $i; next }
      names[++count] = $1
      for (i = 2; i <= NF; ++i) published[$1, paper[i]] = sprintf("%.3g", factor * $i)
      next
    }
    FNR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
    $column["keyframes"] == 10 && $column["rate_hz"] == 4 && $column["windows"] == "all" {
      sub(/_real$/, "", $1)
      key = file SUBSEP $1 SUBSEP $column["initializer"] SUBSEP $column["stage"]
      mean[key] = $column[error "_mean"]; median[key] = $column[error "_median"]; known[$1] = 1
    }
    function pair(file, name, initializer, stage,   key) {
      key = file SUBSEP name SUBSEP initializer SUBSEP stage
      return (key in mean) ? sprintf("%.3f / %.3f", factor * mean[key], factor * median[key]) : "-"
    }
    END {
      short = error; sub(/_.*/, "", short)
      printf "| recording | stage | %s: ORB-SLAM3, paper | ours, paper.ini | ETA, paper | ours, paper.ini | ours, defaults |\n", unit
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

# What the windows in motion of the papers' shape say, an initializer a row: medians, of which conclusions.md speaks.
in_motion() { # summary.csv
  awk -F, '
    NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
    function value(name, factor, format) {
      return $column[name] == "" ? "-" : sprintf(format, factor * $column[name])
    }
    $column["sequence"] == "all" && $column["keyframes"] == 10 && $column["rate_hz"] == 4 && $column["windows"] == "moving" {
      if (!header++) {
        printf "| stage | initializer | windows | refused | success | RRE, deg | ATE, mm | velocity, m/s | gravity, deg | b_g, rad/s | b_a, m/s^2 | scale, %% | ms |\n"
        printf "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n"
      }
      stage = $column["stage"] == "init" ? "without VI-BA" : "with"
      row = sprintf("| %s | `%s` | %d | %d | %.1f %% | %s | %s | %s | %s | %s | %s | %s | %s |\n", stage, $column["initializer"],
        $column["count"], $column["count"] - (stage == "with" ? $column["accepted"] : $column["estimates"]),
        100 * $column["success_rate"], value("rre_deg_median", 1, "%.4f"),
        value("ate_m_median", 1000, "%.2f"), value("velocity_mps_median", 1, "%.4f"), value("gravity_deg_median", 1, "%.2f"),
        value("gyro_bias_rps_median", 1, "%.4f"), value("accel_bias_mps2_median", 1, "%.3f"),
        value("scale_error_median", 100, "%.2f"), value("runtime_ms_median", 1, "%.1f"))
      rows[stage] = rows[stage] row
    }
    END { printf "%s%s", rows["without VI-BA"], rows["with"] }' "$1"
}

# What made a benchmark: its versions, binaries and when.
made_by() { # folder
  sed -nE 's/^ +"(etalon|ceres|mrpt|opencv)": "([^"]+)",?$/\1 \2/p; s/^ "binaries": "([^"]+)",?$/binaries \1/p' "$1/benchmark.json" |
    paste -sd, | sed 's/,/, /g'
}

# The windows of a benchmark: seconds from one to the next; keyframes; rates.
windows_of() { # folder
  sed -n '/"every_s"/,/"vi_ba"/p' "$1/benchmark.json" | tr -d ' \n' |
    sed -E 's/"every_s":([^,]*),"keyframes":\[([^]]*)\],"rates_hz":\[([^]]*)\].*/\1;\2;\3/; s/\.0([,;]|$)/\1/g'
}

# Exit code 1: the benchmark lacks recordings, which the document says.
compare() { # argument of compare...
  local code=0
  "$etalon" compare "$@" --initializers "$initializers" --metric "$compared" || code=$?
  ((code <= 1)) || exit "$code"
}

cat >"$part" <<HEAD
# Results

Written by \`scripts/make_results.sh\`, whose commands stand above the tables; it keeps four digits in \`results/*.csv\`, and of a
summary's other shapes of windows the rows over all recordings; nothing here was typed by hand. What to make of it:
[conclusions.md](conclusions.md). What the columns mean: [evaluation.md](evaluation.md). Every figure by recording, and the shapes of
window that have no table here: \`results/*.csv\`. Run on $(date -u +%F) on $(nproc) cores of $(sed -nE '0,/^model name/s/^model name[^:]*: //p' /proc/cpuinfo | tr -s ' ');
run times with more than one job are of windows that ran beside each other.
HEAD

for group in "$@"; do
  IFS=: read -r group every keyframes rates jobs <<<"$group"
  every=${every:-2.5} keyframes=${keyframes:-10,5} rates=${rates:-4,10} jobs=${jobs:-2}
  name=$(basename "$group")
  recordings=()
  for recording in "$group"/*; do [[ $recording == */about.txt ]] || recordings+=("$recording"); done
  echo "results: $name, ${#recordings[@]} recordings" >&2
  bench() { # folder, windows as windows_of() has them, argument of bench...
    local folder=$out/$1 wanted=$2 code=0
    shift 2
    # A benchmark that is there stays, whatever program made it (benchmark.json says which): its tables can be printed anew.
    if [[ ! -e $folder/windows.csv ]]; then
      "$etalon" bench "${recordings[@]}" --every "$every" --jobs "$jobs" --tracks "$out/tracks" --out "$folder" "$@" >/dev/null || code=$?
      # 3: a recording could not be used, 4: an initializer crashed or used up its time. All else is done, and the document says so.
      ((code == 0 || code == 3 || code == 4)) || exit "$code"
    elif [[ $(windows_of "$folder") != "$wanted" ]]; then
      echo "make_results.sh: '$folder' has windows of EVERY;KEYFRAMES;RATES $(windows_of "$folder"), expected $wanted; name those, or remove it" >&2
      exit 2
    fi
  }
  bench "$name" "$every;$keyframes;$rates" --keyframes "$keyframes" --rate "$rates" --initializers "$initializers"
  bench "${name}_paper" "$every;10;4" --initializers eta,orbslam3_inertial_only -c "$root/config/paper.ini"
  compare "$out/$name" --all --format markdown >"$out/$name.md"
  keep "${name}_summary" <"$out/$name/summary.csv"
  keep "${name}_paper_summary" <"$out/${name}_paper/summary.csv"
  compare "$out/$name" --format csv | awk -F, 'NR == 1 || ($3 == 10 && $4 == 4)' | keep "${name}_comparison"
  {
    printf '\n## %s\n\n' "$name"
    [[ ! -e $group/about.txt ]] || cat "$group/about.txt" - <<<""
    printf '    $ etalon bench %s/* --every %s --keyframes %s --rate %s --jobs %s --initializers %s --out %s\n    $ etalon bench %s/* --every %s --jobs %s --initializers eta,orbslam3_inertial_only -c config/paper.ini --out %s_paper\n    $ etalon compare %s --initializers %s --metric %s --format csv | awk -F, '"'"'NR == 1 || ($3 == 10 && $4 == 4)'"'"' >%s_comparison.csv\n\n' \
      "$name" "$every" "$keyframes" "$rates" "$jobs" "$initializers" "$name" "$name" "$every" "$jobs" "$name" "$name" "$initializers" "$compared" "$name"
    printf 'By %s. The long tables: [summary](results/%s_summary.csv), [with the papers'"'"' noise and priors](results/%s_paper_summary.csv), [which differences are significant](results/%s_comparison.csv).\n\n' \
      "$(made_by "$out/$name")" "$name" "$name" "$name"
    if grep -qE '^ +"error": "[^"]' "$out/$name"{,_paper}/benchmark.json; then
      printf 'Some recordings could not be used; the command says which.\n\n'
    fi
    if grep -qE ',(init|vi_ba),(crashed|time_limit),' "$out/$name"{,_paper}/windows.csv; then
      printf 'In some windows an initializer crashed or used up its time; the command says which, and they count as refused.\n\n'
    fi
    if grep -q ',moving,' "$out/$name/summary.csv"; then
      printf '### In motion, medians\n\nAll recordings, 10 keyframes at 4 Hz (rows `all`, `moving` of the summary):\n\n'
      in_motion "$out/$name/summary.csv"
      printf '\n'
    fi
    printf '### Noise\n\n'
    tables "$out/$name.md" '^..Check of the noise.*10 keyframes at 4 Hz'
    if grep -qE '^(MH|V[12])_[0-9]*_(easy|medium|difficult)(_real)?,' "$out/$name/summary.csv"; then
      printf '### Beside the papers\n\nOurs as mean / median over all windows; `config/paper.ini` has the papers'"'"' noise and priors. The published figures are of whole\nrecordings of real images.\n\n'
      paste -d '' <(beside_the_paper "$out/$name/summary.csv" "$out/${name}_paper/summary.csv" rre_deg 1 'RRE [deg]') \
        <(beside_the_paper "$out/$name/summary.csv" "$out/${name}_paper/summary.csv" ate_m 1000 'ATE [mm]' | cut -d'|' -f4-)
    fi
  } >>"$part"
done
mv "$part" "$document"
echo "results: wrote $document" >&2
