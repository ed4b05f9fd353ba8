#!/usr/bin/env bash
# determinism.sh EIGEN_INCLUDE: labels, instances, beliefs and map have equal bits for every
# installed compiler, for several levels of optimization and for repeated runs.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
compilers=0
builds=0
seen=""
for compiler in g++ clang++ clang++-14; do
  path=$(readlink -f "$(command -v "$compiler")") || continue
  [[ $seen != *"$path;"* ]] || continue
  seen+="$path;"
  compilers=$((compilers + 1))
  for level in -O1 "-O3 -DNDEBUG"; do
    # shellcheck disable=SC2086
    "$compiler" -std=c++17 $level -ffp-contract=off -I"$root/include" -I"$root/tests" -isystem "$1" \
      "$root/tests/reliability/determinism.cpp" "$root/src/remover/remover.cpp" -o "$work/program"
    for run in 1 2; do
      "$work/program" >"$work/said"
      echo "$compiler $level, run $run: $(tr '\n' ';' <"$work/said")"
      [[ -e $work/expected ]] || cp "$work/said" "$work/expected"
      cmp "$work/said" "$work/expected"
    done
    builds=$((builds + 1))
  done
done
((builds > 0)) || { echo "no compiler found"; exit 1; }
! grep -q ' 0 moving' "$work/expected" || { echo "nothing moves in the scene"; exit 1; }
echo "$builds builds by $compilers compilers agree"
