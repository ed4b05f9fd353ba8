#!/usr/bin/env bash
# foreign_logs.sh PROGRAM WORK KIND WRITER...: a run on a log by an independent writer gives the
# labels of a run on the folder, and an independent reader finds that the log of --write-log has no
# moving points and is equal else. KIND is bag or mcap; WRITER is an interpreter and its script.
set -euo pipefail
program=$1 work=$2 kind=$3
shift 3
rm -rf "$work"
mkdir -p "$work"
flags=(--sensor vlp16 --scans 8 --quiet)
"${program}_simulate" "$work/seq" "${flags[@]}"
"$program" run "$work/seq" --out "$work/of_seq" --quiet
if [[ $kind == bag ]]; then
  input=$work/seq
  compressions="none bz2 lz4"
else
  "${program}_simulate" "$work/log" --format mcap "${flags[@]}"
  input=$work/log/drive.mcap
  compressions="lz4 zstd"
fi
for compression in $compressions; do
  log=$work/$compression.$kind
  out=$work/of_$compression
  "$@" "$input" "$log" "$compression" | tee "$work/said"
  if grep -q SKIPPED "$work/said"; then exit 0; fi
  copy=$work/clean_$compression.mcap
  if ! "$program" run "$log" --out "$out" --write-log "$copy" --quiet 2> "$work/error"; then
    # A build without a decompression library names the Debian package in its error.
    grep "this build has no $compression (Debian: lib$compression-dev)" "$work/error"
    continue
  fi
  cat "$work/error"
  diff -r "$work/of_seq/labels" "$out/labels"
  if [[ $kind == mcap ]]; then
    "$1" "${0%/*}/check_clean_mcap.mjs" "$log" "$copy" "$out/labels"
  fi
done
