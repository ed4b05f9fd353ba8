#!/usr/bin/env bash
# faults.sh PROGRAM [KILLS]: `dynains run` with kill -9, with a full disk, without write permission
# and with input that vanishes. The results are absent or complete, the earlier ones stay until then,
# and one more run gives the bytes of an undisturbed one.
set -euo pipefail
program=$1
kills=${2:-12}
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
# Returns when the folder is there, or after ten seconds.
await() { local i; for ((i = 0; i < 2000; ++i)); do [[ -d $1 ]] && break; sleep 0.005; done; }
complete() { grep -q '"complete": true' "$1/report.json" 2>/dev/null; }

seq=$work/seq
"${program}_simulate" "$seq" --scans 8 --sensor vlp16 --quiet
begin=$(date +%s%N)
"$program" run "$seq" --out "$work/expected" --quiet
span=$((($(date +%s%N) - begin) / 1000))  # us
RANDOM=7

# kill_run [FLAG...]: a run that is killed at a random moment, or while its results are put in place.
kill_run() {
  "$program" run "$seq" --out "$work/out" --quiet "$@" &
  pid=$!
  delay=$(((RANDOM * 32768 + RANDOM) % span))
  sleep "$((delay / 1000000)).$(printf %06d $((delay % 1000000)))"
  if ((RANDOM % 2)); then
    while [[ -d $work/out.partial ]] && ! complete "$work/out.partial"; do :; done
  fi
  kill -9 "$pid" 2>/dev/null || true
  wait "$pid" 2>/dev/null || true
}
# as NAME: whether the results are those of $work/NAME.
as() { complete "$work/out" && same "$work/$1" "$work/out"; }

"$program" run "$seq" --out "$work/earlier" --end 4 --write-online --quiet
echo "--- kill -9, $kills times within $((span / 1000)) ms: the earlier results or the new ones, whole"
left=0
for ((i = 0; i < kills || (left == 0 && i < kills + 20); ++i)); do
  rm -rf "$work"/out*
  # Every second run replaces earlier results.
  ((i % 2)) || cp -r "$work/earlier" "$work/out"
  kill_run --force
  [[ ! -d $work/out.partial ]] || left=$((left + 1))
  [[ ! -d $work/out ]] || as earlier >/dev/null || as expected || fail "kill $i left a part"
  [[ -d $work/out ]] || ((i % 2)) || fail "kill $i: the earlier results are lost"
  "$program" run "$seq" --out "$work/out" --force --quiet || fail "kill $i: again"
  as expected || fail "kill $i: other bytes"
  [[ ! -d $work/out/online && $(ls "$work") != *partial* ]] || fail "kill $i: leftovers"
done
echo "$left of them left a folder"
((left > 0)) || fail "no kill hit a run"

echo "--- input that vanishes in the middle"
cp -r "$seq" "$work/vanishing"
"$program" run "$work/vanishing" --out "$work/vanished" --quiet 2>"$work/err" &
pid=$!
await "$work/vanished.partial/labels"
rm -rf "$work/vanishing/velodyne"
code=0
wait "$pid" || code=$?
if [[ $code == 0 ]]; then
  echo "it was read before it vanished"
else
  [[ $code == 1 ]] || fail "vanishing input: exit code $code"
  grep -q 'dynains: error: .*bin' "$work/err" || fail "vanishing input: $(cat "$work/err")"
  [[ $(ls "$work") != *vanished* ]] || fail "vanishing input: leftovers"
fi

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
