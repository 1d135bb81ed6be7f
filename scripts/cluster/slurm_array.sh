#!/usr/bin/env bash
# A benchmark as a Slurm job array: a shard a task.
#
#   sbatch --array=1-16 slurm_array.sh OUT BENCH_ARGUMENT...
#   e.g. job=$(sbatch --parsable --array=1-16 slurm_array.sh /shared/results /shared/euroc/* --initializers all)
#
# and, to join the parts when no task is left:
#
#   sbatch --dependency=afterany:$job --wrap 'etalon merge /shared/results/shard-* --out /shared/results/merged'
#
# `etalon` is the one in the PATH that sbatch hands on. What the nodes must have in common, how to resume, and how to run
# some shards only: docs/benchmark.md, "Slurm". OUT/shards keeps the length of the first array.
#
#SBATCH --job-name=etalon-bench
#SBATCH --cpus-per-task=2
#SBATCH --mem=2G
#SBATCH --time=02:00:00
#SBATCH --open-mode=append
set -euo pipefail

fail() { echo "slurm_array.sh: $1" >&2; exit 2; }

(($# >= 2)) || { sed -n '2,12p' "${BASH_SOURCE[0]}" | sed 's/^# \{0,1\}//' >&2; exit 2; }
task=${SLURM_ARRAY_TASK_ID:-}
[[ -n $task ]] || fail "not a task of an array; submit it as sbatch --array=1-N"
command -v etalon >/dev/null || fail "etalon is not in the PATH of $(hostname): $PATH"

out=$1
shift
mkdir -p "$out"
# A task that is submitted again knows only the numbers of its own array: the first one leaves its length.
if [[ ! -f $out/shards ]]; then
  if ((SLURM_ARRAY_TASK_MIN != 1 || SLURM_ARRAY_TASK_COUNT != SLURM_ARRAY_TASK_MAX)); then
    fail "the first array into '$out' must count from 1 without gaps (--array=1-N)"
  fi
  echo "$SLURM_ARRAY_TASK_MAX" >"$out/shards.$task"
  mv "$out/shards.$task" "$out/shards"
fi
shards=$(<"$out/shards")
((task <= shards)) || fail "there is no shard $task: '$out' was begun with $shards (see $out/shards)"
# exec: Slurm's signals reach etalon, which then stops between two windows, and its exit code is the task's.
exec etalon bench "$@" --shard "$task/$shards" --jobs "${SLURM_CPUS_PER_TASK:-1}" \
  --out "$out/shard-$task" --tracks "$out/tracks"
