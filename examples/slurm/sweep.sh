#!/bin/bash
# A sweep as an array job of SLURM, one shard per task:
#
#     sbatch --array=1-8 --cpus-per-task=4 examples/slurm/sweep.sh plan.toml
#
# A task that was interrupted continues when the job is submitted again.  merge.sh joins the stores.
set -eu
ppg sweep "$1" --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" \
    --jobs "${SLURM_CPUS_PER_TASK:-1}" --store "rows-$SLURM_ARRAY_TASK_ID.db"
