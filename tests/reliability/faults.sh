#!/usr/bin/env bash
# faults.sh PROGRAM: `dynains run` on disks that are full, read-only or locked, by the system itself;
# crash_test.cpp and fault_test.cpp have the moments of a kill and the errors of each call. The results
# are absent or complete, the earlier ones stay until then, and one more run gives the bytes of an
# undisturbed one.
set -euo pipefail
program=$1
work=$(mktemp -d)
disk=$work/disk
cleanup() {
  if mountpoint -q "$disk" 2>/dev/null; then umount "$disk"; fi
  rm -rf "$work"
}
trap cleanup EXIT
failures=0
fail() { echo "FAILED: $*"; failures=$((failures + 1)); }

# Files that depend on nothing but the input: all except timing.csv and report.json.
results() { (cd "$1" && find labels static_map.ply dynamic_points.ply -type f | sort); }
same() {
  diff <(results "$1") <(results "$2") &&
    while read -r file; do cmp "$1/$file" "$2/$file" || return 1; done < <(results "$2")
}

seq=$work/seq
"${program}_simulate" "$seq" --scans 8 --sensor vlp16 --quiet
"$program" run "$seq" --out "$work/expected" --quiet

"$program" run "$seq" --out "$work/earlier" --end 4 --write-online --quiet
echo "--- a result that cannot be removed"
if chattr +i "$work/earlier/report.json" 2>/dev/null; then
  cp -r "$work/earlier" "$work/locked"
  code=0
  "$program" run "$seq" --out "$work/earlier" --force --quiet 2>"$work/err" || code=$?
  chattr -i "$work/earlier/report.json"
  [[ $code == 1 ]] || fail "a locked result: exit code $code"
  grep -q 'report.json: cannot be replaced' "$work/err" || fail "a locked result: $(cat "$work/err")"
  diff -r "$work/locked" "$work/earlier" || fail "a locked result: earlier results changed"
  [[ $(ls "$work") != *partial* ]] || fail "a locked result: leftovers"
else
  not_tested="a result that cannot be removed: chattr has no effect here (needs root)"
fi

echo "--- a full disk"
mkdir "$disk"
if mount -t tmpfs -o size=600k tmpfs "$disk" 2>/dev/null; then
  code=0
  "$program" run "$seq" --out "$disk/out" --quiet 2>"$work/err" || code=$?
  [[ $code == 1 ]] || fail "full disk: exit code $code"
  grep -q 'No space left' "$work/err" || fail "full disk: $(cat "$work/err")"
  [[ -z $(ls "$disk") ]] || fail "full disk: leftovers"
  mount -o remount,size=64m "$disk"
  "$program" run "$seq" --out "$disk/out" --quiet || fail "full disk: again"
  same "$work/expected" "$disk/out" || fail "full disk: other bytes"
  rm -r "${disk:?}/out"
  "$program" run "$seq" --out "$disk" --quiet 2>"$work/err" && fail "a mounted folder was replaced"
  grep -q 'choose a folder in it' "$work/err" || fail "a mounted folder: $(cat "$work/err")"
  "$program" run "$seq" --out "$disk/out" --quiet || fail "a folder that is mounted: below it"

  echo "--- a file system that is read-only"
  mount -o remount,ro "$disk"
  code=0
  "$program" run "$seq" --out "$disk/out" --force --quiet 2>"$work/err" || code=$?
  [[ $code == 1 ]] || fail "read-only: exit code $code"
  grep -q 'Read-only' "$work/err" || fail "read-only: $(cat "$work/err")"
  same "$work/expected" "$disk/out" || fail "read-only: earlier results changed"
else
  not_tested="a full and a read-only disk: a tmpfs cannot be mounted here (needs root)"
fi

if ((failures > 0)); then exit 1; fi
if [[ -n ${not_tested:-} ]]; then echo "SKIPPED: $not_tested"; else echo "all held"; fi
