#!/usr/bin/env bash
# Tests that take longer than the suite, one a call:
#
# tests/long.sh fuzz NAME SECONDS   a fuzzer of tests/fuzz, for example pcd or facade; all: each
# tests/long.sh asan|asan-gcc|tsan  the suite under sanitizers; GCC compiles other SIMD kernels
# tests/long.sh coverage            lines of include/ and src/ that the tests reach
# tests/long.sh disturbed STARTS    every state after a power cut, every error of every call, and so
#                                   many random starts of the program
# tests/long.sh endurance SCANS     scans in one remover
set -euo pipefail
cd "$(dirname "$0")/.."

# build FOLDER OPTION...
build() {
  cmake -B "$1" "${@:2}"
  cmake --build "$1" -j2
}

# suite FOLDER OPTION...
suite() {
  build "$@"
  ctest --test-dir "$1" --output-on-failure -j2
}

debug=(-DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS=-O1)
python=(-DDYNAINS_BUILD_PYTHON=ON -DPython3_EXECUTABLE=/usr/bin/python3)

fuzz() {
  CXX=${CXX:-clang++} cmake -B build-fuzz -DDYNAINS_BUILD_FUZZERS=ON -DCMAKE_BUILD_TYPE=Debug \
    -DCMAKE_CXX_FLAGS=-O2 -DDYNAINS_FUZZ_SECONDS="$2"
  cmake --build build-fuzz -j2 --target fuzzers
  if [[ $1 == all ]]; then
    ctest --test-dir build-fuzz -L fuzz --output-on-failure -j2
    return
  fi
  build-fuzz/tests/fuzz/dynains_write_seeds build-fuzz/tests/fuzz/corpus
  local options=("-max_total_time=$2" -timeout=20 -malloc_limit_mb=512)
  [[ $1 != facade ]] || options+=(-entropic=0 -detect_leaks=0 -max_len=256)
  cd build-fuzz/tests/fuzz
  TMPDIR=/dev/shm ASAN_OPTIONS=quarantine_size_mb=8 "./fuzz_$1" "${options[@]}" "corpus/$1"
}

case "${1:-}" in
  fuzz) fuzz "$2" "$3" ;;
  asan)
    CXX=clang++ suite build-asan "${debug[@]}" "${python[@]}" -DDYNAINS_SANITIZE="address;undefined"
    ;;
  asan-gcc)
    # The checks are calls: inlined, a file takes minutes to compile.
    CXX=g++ suite build-asan-gcc -DCMAKE_BUILD_TYPE=Debug -DDYNAINS_SANITIZE="address;undefined" \
      -DCMAKE_CXX_FLAGS="-O1 --param asan-instrumentation-with-call-threshold=0"
    ;;
  tsan) CXX=clang++ suite build-tsan "${debug[@]}" -DDYNAINS_SANITIZE=thread ;;
  coverage)
    CXX=g++ suite build-cov -DCMAKE_BUILD_TYPE=Debug -DDYNAINS_COVERAGE=ON "${python[@]}"
    gcovr --root . --filter include/ --filter src/ --print-summary build-cov
    ;;
  disturbed)
    build build -DDYNAINS_CRASH_STATES=100000 -DDYNAINS_ALL_FAULTS=ON
    DYNAINS_FAULTS_OF=1 ctest --test-dir build --output-on-failure -R '^disturbed:'
    TMPDIR=/dev/shm DYNAINS_PROGRAM_STARTS=$2 \
      build/tests/reliability/test_disturbed "the program is started at random"
    ;;
  endurance)
    build build
    DYNAINS_ENDURANCE_SCANS=$2 build/tests/reliability/test_reliability "[endurance]"
    ;;
  *)
    sed -n '4,10s/^# //p' "$0" >&2
    exit 2
    ;;
esac
