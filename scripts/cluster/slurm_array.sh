#!/usr/bin/env bash
# A benchmark as a Slurm job array: a shard a task.
#
#   sbatch --array=1-16 slurm_array.sh OUT BENCH_ARGUMENT...
#   e.g. sbatch --array=1-16 slurm_array.sh /shared/results /shared/euroc/* --initializers all
#
# and when all tasks are done, which sbatch --dependency=afterok:JOBID --wrap can wait for:
#
#   etalon merge /shared/results/shard-* --out /shared/results/merged
#
# OUT, the recordings and Etalon must be on a file system that all nodes share. A task that was killed is
# resumed by submitting its number again (--array=7). The array must count from 1 without gaps.
#
#SBATCH --job-name=etalon-bench
#SBATCH --cpus-per-task=2
#SBATCH --mem=2G
#SBATCH --time=02:00:00
set -euo pipefail

(($# >= 2)) || { sed -n '2,12p' "${BASH_SOURCE[0]}" | sed 's/^# \{0,1\}//' >&2; exit 2; }
: "${SLURM_ARRAY_TASK_ID:?run it through sbatch --array=1-N}"
# A task that is submitted again alone knows only itself; the first submission leaves the number of shards.
out=$1
shift
mkdir -p "$out"
if [[ -f $out/shards ]]; then
  shards=$(<"$out/shards")
else
  shards=${SLURM_ARRAY_TASK_MAX:?}
  echo "$shards" >"$out/shards.$SLURM_ARRAY_TASK_ID"
  mv "$out/shards.$SLURM_ARRAY_TASK_ID" "$out/shards"
fi
etalon bench "$@" --shard "$SLURM_ARRAY_TASK_ID/$shards" --jobs "${SLURM_CPUS_PER_TASK:-1}" \
  --out "$out/shard-$SLURM_ARRAY_TASK_ID" --tracks "$out/tracks"
