#!/usr/bin/env bash
# determinism.sh EIGEN_INCLUDE [LIBRARY COMPILER LEVEL]: labels, instances, beliefs and map have equal
# bits for every installed compiler, for several levels of optimization of the remover and for
# repeated runs. LIBRARY is the remover, compiled by that compiler and level already.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
library=${2:-}
library_by="$(readlink -f "${3:-/}") ${4:-}"
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
  compile=("$compiler" -std=c++17 -ffp-contract=off -I"$root/include" -I"$root/src" -I"$root/tests" -isystem "$1")
  "${compile[@]}" -O1 -c "$root/tests/reliability/determinism.cpp" -o "$work/program.o"
  for level in -O0 "-O3 -DNDEBUG"; do
    remover=$library
    if [[ "$path $level" != "$library_by" ]]; then
      remover=$work/remover.o
      # shellcheck disable=SC2086
      "${compile[@]}" $level -c "$root/src/remover/remover.cpp" -o "$remover"
    fi
    "$compiler" "$work/program.o" "$remover" -o "$work/program"
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
