#!/usr/bin/env bash
# las_map.sh PROGRAM WORK NODE: an independent reader finds in a map of LAS the points of PLY.
set -euo pipefail
program=$1 work=$2 node=$3
script=${0%/*}/check_las.mjs
rm -rf "$work"
mkdir -p "$work"
"$program" simulate "$work/seq" --sensor vlp16 --scans 12 --quiet
"$program" run "$work/seq" --out "$work/of_ply" --map-attributes --quiet
crs=(--crs EPSG:25832)
if ! "$program" run "$work/seq" --out "$work/of_las" --map "$work/map.las" "${crs[@]}" --quiet \
  2> "$work/error"; then
  grep "this build has no PROJ" "$work/error"
  crs=()
  "$program" run "$work/seq" --out "$work/of_las" --map "$work/map.las" --quiet
fi
said=$("$node" "$script" "$work/map.las" "$work/of_ply/static_map.ply")
echo "$said"
if [[ ${#crs[@]} -gt 0 && $said != SKIPPED* ]]; then grep -q "UTM zone 32N" <<< "$said"; fi
