#!/usr/bin/env bash
# Spreads a benchmark over processors and hosts with GNU parallel, and joins the parts.
#
#   gnu_parallel.sh SHARDS OUT [PARALLEL_OPTION]... -- BENCH_ARGUMENT...
#
#   gnu_parallel.sh 8 results --jobs 4 -- /data/euroc/*                      # this machine, 4 at a time
#   gnu_parallel.sh 32 /shared/results --sshlogin 8/node1,8/node2 --workdir . -- /shared/euroc/* --initializers all
#
# Every shard runs as `etalon bench BENCH_ARGUMENT... --shard K/SHARDS --jobs 1` into OUT/shard-K; the
# front end's tracks are shared in OUT/tracks; the result is in OUT/merged. Over several hosts all paths
# must be the same on each of them (a shared file system), and so must the installation of Etalon: the
# parts of different builds are refused. The same command resumes what was interrupted.
# `etalon` is taken from PATH; --etalon PROGRAM as first argument names another one.
set -euo pipefail

usage() { sed -n '2,15p' "${BASH_SOURCE[0]}" | sed 's/^# \{0,1\}//' >&2; exit 2; }

etalon=etalon
if [[ ${1:-} == --etalon ]]; then
  (($# >= 2)) || usage
  etalon=$2
  shift 2
fi
(($# >= 2)) && [[ $1 =~ ^[1-9][0-9]*$ ]] || usage
shards=$1 out=$2
shift 2
options=()
while (($# > 0)) && [[ $1 != -- ]]; do
  options+=("$1")
  shift
done
(($# >= 2)) || usage
shift
command -v parallel >/dev/null || { echo "gnu_parallel.sh: GNU parallel is missing (Debian: apt-get install parallel)" >&2; exit 2; }

mkdir -p "$out"
# A shard ends with 3 if a recording cannot be used: the others are joined all the same.
status=0
seq "$shards" | parallel --will-cite --quote --line-buffer --joblog "$out/parallel.log" "${options[@]}" \
  "$etalon" bench "$@" --shard "{}/$shards" --jobs 1 --out "$out/shard-{}" --tracks "$out/tracks" \
  --format csv >"$out/shards.csv" || status=$?
folders=()
for ((k = 1; k <= shards; ++k)); do folders+=("$out/shard-$k"); done
"$etalon" merge "${folders[@]}" --out "$out/merged" --overwrite
((status == 0)) || echo "gnu_parallel.sh: $status shards did not end with 0, see $out/parallel.log" >&2
exit $((status == 0 ? 0 : 3))
