#!/usr/bin/env bash
# foreign_logs.sh PROGRAM WORK KIND WRITER...: a run on a log by an independent writer gives the
# labels of a run on the folder, and an independent reader finds that the log of --write-log has no
# moving points and is equal else. KIND is bag, mcap or db3; WRITER is an interpreter and its script.
# For db3, which no other writer makes here, the script is the reader.
set -euo pipefail
program=$1 work=$2 kind=$3
shift 3
rm -rf "$work"
mkdir -p "$work"
flags=(--sensor vlp16 --scans 8 --quiet)
"$program" simulate "$work/seq" "${flags[@]}"
"$program" run "$work/seq" --out "$work/of_seq" --quiet
checked() {  # LOG COPY LABELS, by the interpreter $1
  local script=check_clean_log.py
  if [[ $kind == mcap ]]; then script=check_clean_mcap.mjs; fi
  "$1" "${0%/*}/$script" "${@:2}"
}
if [[ $kind == db3 ]]; then
  "$program" simulate "$work/log" --format db3 "${flags[@]}"
  log=$(find "$work/log" -name '*.db3')
  "$program" run "$log" --out "$work/of_db3" --write-log "$work/clean.db3" --quiet
  diff -r "$work/of_seq/labels" "$work/of_db3/labels"
  checked "$1" "$log" "$work/clean.db3" "$work/of_db3/labels"
  exit 0
fi
if [[ $kind == bag ]]; then
  "$program" simulate "$work/log" --format bag "${flags[@]}"
  "$1" "${2%/*}/check_bag.py" "$work/log/drive.bag" "$work/seq" 2>&1 | tee "$work/said"
  if grep -q SKIPPED "$work/said"; then exit 0; fi
  grep -q "8 clouds are equal" "$work/said"
  # python3-rosbag compares the definitions of messages with their checksums.
  if grep "WARNING" "$work/said"; then exit 1; fi
  input=$work/seq
  compressions="none bz2 lz4"
else
  "$program" simulate "$work/log" --format mcap "${flags[@]}"
  input=$work/log/drive.mcap
  compressions="lz4 zstd"
fi
for compression in $compressions; do
  log=$work/$compression.$kind
  out=$work/of_$compression
  "$@" "$input" "$log" "$compression" | tee "$work/said"
  if grep -q SKIPPED "$work/said"; then exit 0; fi
  copy=$work/clean_$compression.$kind
  if ! "$program" run "$log" --out "$out" --write-log "$copy" --quiet 2> "$work/error"; then
    # A build without a decompression library names the Debian package in its error.
    grep "this build has no $compression (Debian: lib$compression-dev)" "$work/error"
    continue
  fi
  cat "$work/error"
  diff -r "$work/of_seq/labels" "$out/labels"
  checked "$1" "$log" "$copy" "$out/labels"
done
