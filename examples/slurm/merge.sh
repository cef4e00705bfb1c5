#!/bin/bash
# Joins the stores of an array job into rows.db, and runs the cells that no task has:
#
#     sbatch --dependency=afterok:JOB examples/slurm/merge.sh plan.toml
set -eu
merges=()
for store in rows-*.db; do
    merges+=(--merge "$store")
done
ppg sweep "$1" --store rows.db "${merges[@]}"
