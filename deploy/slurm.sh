#!/bin/bash
# Starts workers of mocban as a Slurm array: sbatch deploy/slurm.sh /shared/blocks
# The project's mocban.toml names the catalog in PostgreSQL; the password is in ~/.pgpass. Run `mocban plan` first.
#SBATCH --job-name=mocban
#SBATCH --array=0-3
#SBATCH --cpus-per-task=8
#SBATCH --mem=8G
#SBATCH --requeue
# Slurm sends SIGTERM 20 s before the time limit, and the worker gives its pairs back. Without `B:`, only steps of
# `srun` would receive it. To end one worker by hand: scancel --batch --signal=TERM JOBID
#SBATCH --signal=B:TERM@20
exec mocban -C "${1:?give the project folder}" worker --jobs "${SLURM_CPUS_PER_TASK:-1}" --memory 6G
