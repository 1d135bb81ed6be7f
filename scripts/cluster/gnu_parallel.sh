#!/usr/bin/env bash
# Spreads a benchmark over processors and hosts with GNU parallel, and joins the parts.
#
#   gnu_parallel.sh [--etalon PROGRAM] SHARDS OUT [PARALLEL_OPTION]... -- BENCH_ARGUMENT...
#
#   gnu_parallel.sh 8 results --jobs 4 -- /data/euroc/*                      # this machine, 4 at a time
#   gnu_parallel.sh 32 /shared/results --sshlogin 8/node1,8/node2 --retries 3 -- /shared/euroc/* --initializers all
#
# Shard K lies in OUT/shard-K, the front end's tracks in OUT/tracks, the result in OUT/merged. What the hosts must have in
# common, what happens to a host that fails, and how to resume: docs/benchmark.md, "Beyond one machine".
# `etalon` is the one in this machine's PATH; --etalon PROGRAM as first argument names another one.
#
# Exit code 0: all done; 3: joined, but a recording could not be used; 4: joined, but an initializer crashed or used up its
# time in some windows; 2: parts are missing, damaged or do not fit.
set -euo pipefail

usage() { sed -n '2,14p' "${BASH_SOURCE[0]}" | sed 's/^# \{0,1\}//' >&2; exit 2; }
fail() { echo "gnu_parallel.sh: $1" >&2; exit 2; }

etalon=etalon
if [[ ${1:-} == --etalon ]]; then
  (($# >= 2)) || usage
  etalon=$2
  shift 2
fi
if (($# < 2)) || ! [[ $1 =~ ^[1-9][0-9]*$ ]]; then usage; fi
shards=$1 out=$2
shift 2
options=()
while (($# > 0)) && [[ $1 != -- ]]; do
  options+=("$1")
  shift
done
(($# >= 2)) || usage
shift
command -v parallel >/dev/null || fail "GNU parallel is missing (Debian: apt-get install parallel)"
# Absolute: the PATH of a host that is reached through ssh is another one.
etalon=$(command -v "$etalon") || fail "there is no program '$etalon'"
etalon=$(realpath --no-symlinks "$etalon")

mkdir -p "$out"
log=$out/parallel.log
rm -f "$log"
status=0
seq "$shards" | parallel --will-cite --quote --line-buffer --joblog "$log" --workdir . "${options[@]}" \
  "$etalon" bench "$@" --shard "{}/$shards" --jobs 1 --out "$out/shard-{}" --tracks "$out/tracks" \
  >/dev/null || status=$?
# A line a shard in the log: number, host, start, run time, bytes sent and received, exit code, signal, command.
if [[ ! -f $log ]] || (($(wc -l <"$log") <= 1)); then fail "GNU parallel ended with $status and ran nothing"; fi
# What a shard ended with decides nothing: merge finds what is missing, and its exit code is the script's.
awk -F '\t' 'NR > 1 && ($7 != 0 || $8 != 0) {
  printf "gnu_parallel.sh: shard %s on %s ended with %s%s\n", $1, ($2 == ":" ? "this machine" : $2), $7,
      ($8 != 0 ? ", signal " $8 : "")
}' "$log" >&2

folders=()
for ((k = 1; k <= shards; ++k)); do folders+=("$out/shard-$k"); done
code=0
"$etalon" merge "${folders[@]}" --out "$out/merged" --overwrite || code=$?
case $code in
  0 | 3 | 4) exit "$code" ;;
esac
fail "the parts were not joined. The same command does what is missing; a part of another build or host \
begins anew if its folder is removed. Which host ran which: $log"
