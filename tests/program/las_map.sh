#!/usr/bin/env bash
# las_map.sh PROGRAM WORK NODE: an independent reader finds in a map of LAS the points of PLY.
set -euo pipefail
program=$1 work=$2 node=$3
script=${0%/*}/check_las.mjs
rm -rf "$work"
mkdir -p "$work"
"${program}_simulate" "$work/seq" --sensor vlp16 --scans 12 --quiet
"$program" run "$work/seq" --out "$work/of_ply" --map-attributes --quiet
crs='LOCAL_CS["a yard"]'
"$program" run "$work/seq" --out "$work/of_las" --map "$work/map.las" --crs "$crs" --quiet
"$node" "$script" "$work/map.las" "$work/of_ply/static_map.ply" "$crs"
