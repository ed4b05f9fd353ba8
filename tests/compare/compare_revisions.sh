#!/usr/bin/env bash
# Compares this working tree with another revision: the results of `dynains run` byte by byte, and
# the least median time of a frame.
#
#   tests/compare/compare_revisions.sh BASE WORK [SEQUENCE...]
#
# BASE: a git revision. WORK: a folder for programs and simulated recordings, kept between calls.
# SEQUENCE: recordings; without any, six simulated scenes are used.
#
# Other variables: VARIANTS, a choice of gcc, gcc-avx2, gcc-plain and clang [all]; TURNS, timed
# runs of each version for each recording and preset [3; 0 compares bytes only].
#
# Exit code: 0 if all bytes are equal.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
base=${1:?a revision} work=${2:?a folder}
shift 2
turns=${TURNS:-3}
mkdir -p "$work"
work=$(cd "$work" && pwd)
revision=$(git -C "$root" rev-parse --verify "$base^{commit}")
mkdir -p "$work/$revision"
git -C "$root" archive "$revision" | tar -x -C "$work/$revision"

build() {  # folder of sources, variant, folder of the program
  local compiler=g++ flags=""
  case $2 in
    gcc) ;;
    gcc-avx2) flags=-mavx2 ;;
    gcc-plain) flags=-U__SSE2__ ;;
    clang) compiler=clang++-14 ;;
    *) echo "unknown variant $2" >&2; return 2 ;;
  esac
  cmake -S "$1" -B "$3" -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=$compiler \
    -DCMAKE_CXX_FLAGS=$flags -DDYNAINS_BUILD_TESTS=OFF -DDYNAINS_BUILD_EXAMPLES=OFF \
    -DDYNAINS_BUILD_PYTHON=OFF >/dev/null
  cmake --build "$3" -j2 --target dynains_program >/dev/null
}
# run VERSION SEQUENCE PRESET: prints the median time of a frame, ms.
run() {
  "$work/$1/bin/dynains" run "$2" --preset "$3" --out "$work/$1/out" --write-beliefs \
    --write-online --accept-poses --force --quiet
  grep -A1 '"total": {' "$work/$1/out/report.json" | grep -o '[0-9.]*' | tail -n 1
}
least() { for ((turn = 0; turn < turns; ++turn)); do run "$@"; done | sort -n | head -n 1; }

different=0
for variant in ${VARIANTS:-gcc gcc-avx2 gcc-plain clang}; do
  before=${revision}_$variant after=now_$variant
  build "$work/$revision" "$variant" "$work/$before"
  build "$root" "$variant" "$work/$after"
  if [[ $# -eq 0 ]]; then
    cmake --build "$work/$after" -j2 --target dynains_simulate >/dev/null
    for scene in urban:hdl64 highway:hdl64 crowd:os1-64 stop-and-go:hdl64 vegetation:vlp16 car-park:hdl64; do
      "$work/$after/bin/dynains_simulate" "$work/${scene/:/_}" --force -q --seed 11 \
        --scene "${scene%:*}" --sensor "${scene#*:}" --scans 60
      set -- "$@" "$work/${scene/:/_}"
    done
  fi
  for sequence in "$@"; do
    for preset in default paper; do
      name="$variant $preset $(basename "$sequence")"
      run "$before" "$sequence" $preset >/dev/null
      run "$after" "$sequence" $preset >/dev/null
      if diff -rq --exclude=report.json --exclude=timing.csv "$work/$before/out" "$work/$after/out"; then
        echo "$name: all bytes are equal"
      else
        echo "$name: DIFFERENT"
        different=1
      fi
      [[ $turns -gt 0 ]] || continue
      echo "$name: least median of a frame $(least "$before" "$sequence" $preset) ms before," \
        "$(least "$after" "$sequence" $preset) ms after"
    done
  done
done
exit $different
