#!/usr/bin/env bash
# verdicts.sh PROGRAM WORK NODE: an independent reader finds in verdicts.mcap the results of the run.
set -euo pipefail
program=$1 work=$2 node=$3
rm -rf "$work"
mkdir -p "$work"
"$program" simulate "$work/seq" --sensor vlp16 --scans 12 --quiet
"$program" run "$work/seq" --out "$work/out" --write-mcap --quiet
"$node" "${0%/*}/check_verdicts.mjs" "$work/out"
