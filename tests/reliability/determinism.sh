#!/usr/bin/env bash
# determinism.sh EIGEN_INCLUDE [LIBRARY COMPILER LEVEL]: labels, instances, beliefs and map have equal
# bits for every installed compiler, for several levels of optimization of the remover, for repeated
# runs, for other SIMD packs and for another processor. If the compiler may fuse multiplications and
# additions, as that of a consumer may, few labels change. LIBRARY is the remover, compiled by that
# compiler and level already.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
library=${2:-}
library_by="$(readlink -f "${3:-/}") ${4:-}"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
sources=("$root/tests/reliability/determinism.cpp" "$root/src/remover/remover.cpp")
common=(-std=c++17 -I"$root/include" -I"$root/src" -I"$root/tests" -isystem "$1")
builds=0

# agree NAME COMMAND...: prints what a build says, which is what the first one said.
agree() {
  local name=$1
  shift
  "$@" >"$work/said"
  echo "$name: $(tr '\n' ';' <"$work/said")"
  [[ -e $work/expected ]] || cp "$work/said" "$work/expected"
  cmp "$work/said" "$work/expected"
}
# build COMPILER FLAG...: compiles program and remover alike.
build() {
  "$1" "${common[@]}" "${@:2}" "${sources[@]}" -o "$work/program"
  builds=$((builds + 1))
}
has() { grep -qwm1 "$1" /proc/cpuinfo; }

seen=""
for compiler in g++ clang++ clang++-14; do
  path=$(readlink -f "$(command -v "$compiler")") || continue
  [[ $seen != *"$path;"* ]] || continue
  seen+="$path;"
  compile=("$compiler" "${common[@]}" -ffp-contract=off)
  "${compile[@]}" -O1 -c "${sources[0]}" -o "$work/program.o"
  for level in -O0 "-O3 -DNDEBUG"; do
    remover=$library
    if [[ "$path $level" != "$library_by" ]]; then
      remover=$work/remover.o
      # shellcheck disable=SC2086
      "${compile[@]}" $level -c "${sources[1]}" -o "$remover"
    fi
    "$compiler" "$work/program.o" "$remover" -o "$work/program"
    for run in 1 2; do agree "$compiler $level, run $run" "$work/program" "$work/exact"; done
    builds=$((builds + 1))
  done
done
((builds > 0)) || { echo "no compiler found"; exit 1; }
! grep -q ' 0 moving' "$work/expected" || { echo "nothing moves in the scene"; exit 1; }

compiler=$(command -v g++ || command -v clang++)
fused=(-ffp-contract=fast)
if [[ $(uname -m) == x86_64 ]]; then
  build "$compiler" -ffp-contract=off -O1 -U__SSE2__
  agree "packs without SSE" "$work/program"
  if has avx2; then  # the compiler vectorizes loops of the whole program
    build "$compiler" -ffp-contract=off -O2 -ftree-vectorize -mavx2
    agree "AVX2" "$work/program"
  fi
  fused+=(-mfma)
fi
if [[ $(uname -m) != x86_64 ]] || has fma; then
  build "$compiler" -O2 "${fused[@]}"
  "$work/program" "$work/fused" | tr '\n' ';'
  different=$({ cmp -l "$work/exact" "$work/fused" || true; } | wc -l)
  labels=$(stat -c %s "$work/exact")
  echo "with contraction, $different of $labels labels differ"
  ((labels == $(stat -c %s "$work/fused") && different * 1000 < labels)) || exit 1
fi
if command -v aarch64-linux-gnu-g++ qemu-aarch64 >"$work/found"; then
  build aarch64-linux-gnu-g++ -ffp-contract=off -O2 -static
  agree "aarch64" qemu-aarch64 "$work/program"
else
  echo "not tested on aarch64: without aarch64-linux-gnu-g++ and qemu-aarch64"
fi
echo "$builds builds agree"
