#!/usr/bin/env bash
# Compares this working tree with another revision: verdicts and maps byte by byte, and times of a
# frame by alternating runs of both versions.
#
#   tests/compare/compare_revisions.sh BASE WORK [SEQUENCE...]
#
# BASE: a git revision. WORK: a folder for programs and simulated recordings, kept between calls.
# SEQUENCE: recordings in the layout of KITTI; without any, six simulated scenes are used, made by
# the program that the variable DYNAINS names [build/bin/dynains].
#
# Other variables: VARIANTS, a choice of gcc, gcc-avx2, gcc-plain and clang [all]; TURNS, pairs of
# timed runs for each recording and preset [3; 0 compares bytes only]; SCANS, the most scans of a
# recording [60].
#
# Exit code: 0 if all bytes are equal.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
base=${1:?a revision} work=${2:?a folder}
shift 2
variants=${VARIANTS:-gcc gcc-avx2 gcc-plain clang}
turns=${TURNS:-3} scans=${SCANS:-60}
eigen=$(pkg-config --cflags-only-I eigen3)

mkdir -p "$work"
work=$(cd "$work" && pwd)
revision=$(git -C "$root" rev-parse --verify "$base^{commit}")
git -C "$root" archive "$revision" include | tar -x -C "$(mkdir -p "$work/$revision" && cd "$work/$revision" && pwd)"

compile() {  # variant, folder of headers, program
  local compiler=${CXX_GCC:-g++} flags=""
  case $1 in
    gcc) ;;
    gcc-avx2) flags=-mavx2 ;;
    gcc-plain) flags=-U__SSE2__ ;;
    clang) compiler=${CXX_CLANG:-clang++-14} ;;
    *) echo "unknown variant $1" >&2; return 2 ;;
  esac
  # shellcheck disable=SC2086
  ${LAUNCHER:-} $compiler -std=c++17 -O3 -DNDEBUG -ffp-contract=off $flags $eigen -I"$2" \
    "$here/verdict_bytes.cpp" -o "$3"
}

sequences=("$@")
if [[ ${#sequences[@]} -eq 0 ]]; then
  for scene in urban:hdl64 highway:hdl64 crowd:os1-64 stop-and-go:hdl64 vegetation:vlp16 car-park:hdl64; do
    folder=$work/${scene/:/_}
    if [[ ! -e $folder/poses.txt ]]; then
      "${DYNAINS:-$root/build/bin/dynains}" simulate "$folder" --force -q --seed 11 \
        --scene "${scene%:*}" --sensor "${scene#*:}" --scans "$scans"
    fi
    sequences+=("$folder")
  done
fi

different=0
for variant in $variants; do
  before=$work/$revision/verdict_bytes_$variant after=$work/verdict_bytes_$variant
  [[ -x $before ]] || compile "$variant" "$work/$revision/include" "$before"
  compile "$variant" "$root/include" "$after"
  for sequence in "${sequences[@]}"; do
    for preset in default paper; do
      name="$variant $preset $(basename "$sequence")"
      "$before" "$sequence" $preset "$work/before" "$scans" >/dev/null
      "$after" "$sequence" $preset "$work/after" "$scans" >/dev/null
      if cmp -s "$work/before" "$work/after"; then
        echo "$name: $(stat -c %s "$work/after") bytes are equal"
      else
        echo "$name: DIFFERENT ($(cmp "$work/before" "$work/after" 2>&1 || true))"
        different=1
      fi
      [[ $turns -gt 0 ]] || continue
      for ((turn = 0; turn < turns; ++turn)); do
        "$before" "$sequence" $preset /dev/null "$scans" >>"$work/times_before"
        "$after" "$sequence" $preset /dev/null "$scans" >>"$work/times_after"
        "$after" "$sequence" $preset /dev/null "$scans" >>"$work/times_after"
        "$before" "$sequence" $preset /dev/null "$scans" >>"$work/times_before"
      done
      least=$(sort -n "$work/times_before" | head -n 1) now=$(sort -n "$work/times_after" | head -n 1)
      rm "$work/times_before" "$work/times_after"
      echo "$name: least median of a frame $least ms before, $now ms after," \
        "ratio $(awk "BEGIN { printf \"%.3f\", $now / $least }")"
    done
  done
done
exit $different
