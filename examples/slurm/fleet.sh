#!/bin/sh
# Cleans many recordings on all nodes of a job of Slurm:
#
#   sbatch --nodes=10 --ntasks-per-node=16 fleet.sh LOGS... --out OUT [--city CITY]
#
# Each task is a worker of Dask with one thread. Every node needs dynains, its Python module and Dask
# (Debian: python3-distributed), and reaches LOGS, OUT and the folder of the job by the same paths.
# The same command completes the work of a job that ended early.
set -eu
file="$PWD/dask-$SLURM_JOB_ID.json"
scheduler= workers=
trap 'kill $scheduler $workers 2> /dev/null || true; rm -f "$file"' EXIT
python3 -m distributed.cli.dask_scheduler --port 0 --no-dashboard --scheduler-file "$file" &
scheduler=$!
srun python3 -m distributed.cli.dask_worker --scheduler-file "$file" --nthreads 1 --no-nanny &
workers=$!
until [ -s "$file" ]; do
  kill -0 "$scheduler"  # ends the job if the scheduler has ended
  sleep 1
done
dynains fleet "$@" --scheduler "$file"
