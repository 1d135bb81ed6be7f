#!/usr/bin/env bash
# Replays cuts of recordings with a fault in each, and prints a Markdown table: is the fault survived, is it said, and what does it
# add to the ATE?
#
#   scripts/measure_faults.sh TOOL OUT SRC AT,AT,... [SRC AT,AT,...]...
#
# TOOL SRC DST FAULT makes a faulted copy of a recording (see measure_odometry.sh). A cut is from 8 s before AT to 12 s after it, s;
# faults of the whole cut (lose, every) are in all of it, the others begin at AT. OUT keeps the rows; runs that are there are not made again.
set -euo pipefail
here=$(dirname "${BASH_SOURCE[0]}")
[[ $# -ge 4 ]] || { sed -n '2,9p' "$0"; exit 2; }
tool=$1 out=$2
shift 2
faults=(frozen:@:1 drop:@:0.5 drop:@:1 drop:@:2 imugap:@:0.1 imugap:@:0.5 imugap:@:1 lose:10:1 lose:30:1 every:2 every:4 jump:@:5)
for kind in left black; do for s in 3 2 1 0.5 0.2; do faults=("$kind:@:$s" "${faults[@]}"); done; done
mkdir -p "$out"
: >"$out/rows"
while [[ $# -ge 2 ]]; do
  for at in ${2//,/ }; do
    cut="part:$((at - 8)):$((at + 12))"
    list=$cut
    for fault in "${faults[@]}"; do list+=",$cut ${fault//@/$at}"; done
    "$here/measure_odometry.sh" --faults "$tool" "$list" "$out/$at" "$1" | tail -n +3 | sed "s/:$at:/:/" >>"$out/rows"
    find "$out/$at" -type f ! -name row ! -name initialization.json -delete
  done
  shift 2
done
awk -F ' *[|] *' '
  NF < 5 { next }
  {
    sub(/^part:[^ ]* ?/, "", $3)
    fault = $3
    if (fault == "") { plain = $4; events = $NF == "" ? $(NF - 1) : $NF; base[$2] = base[$2] sprintf("%s%.1f", base[$2] ? ", " : "", 1000 * $4); next }
    said_now = ($NF == "" ? $(NF - 1) : $NF) != events
    key = fault SUBSEP $2
    if (!(fault in known)) { known[fault] = 1; order[++n] = fault }
    if (!($2 in recording)) { recording[$2] = 1; names[++m] = $2 }
    ++runs[fault]
    survived[fault] += $0 !~ /lost/ && $4 < 0.5
    said[fault] += said_now
    added[key] = added[key] sprintf("%s%+.1f", key in added ? ", " : "", 1000 * ($4 - plain))
  }
  END {
    line = "| fault | survived | said |"; rule = "|---|---|---|"; none = "| none: ATE, mm | – | – |"
    for (i = 1; i <= m; ++i) { line = line " " names[i] ": ATE added, mm |"; rule = rule "---|"; none = none " " base[names[i]] " |" }
    print line; print rule; print none
    for (k = 1; k <= n; ++k) {
      fault = order[k]
      row = sprintf("| %s | %d of %d | %d of %d |", fault, survived[fault], runs[fault], said[fault], runs[fault])
      for (i = 1; i <= m; ++i) row = row " " added[fault SUBSEP names[i]] " |"
      print row
    }
  }' "$out/rows"
