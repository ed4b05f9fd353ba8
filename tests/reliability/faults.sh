#!/usr/bin/env bash
# faults.sh PROGRAM [KILLS]: `dynains run` with kill -9, with a full disk, without write permission
# and with input that vanishes. Each file is absent or complete, report.json has "complete": false
# until all files are written, and --resume gives the bytes of an undisturbed run.
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
# whole FOLDER [EXPECTED]: every label file under its final name has the length of that of the
# undisturbed run, every cloud has its bytes.
whole() {
  local file expected=${2:-$work/expected}
  for file in "$1"/labels/*.label; do
    [[ -e $file ]] || continue
    [[ $(stat -c %s "$file") == $(stat -c %s "$expected/labels/${file##*/}") ]] || return 1
  done
  for file in static_map.ply dynamic_points.ply; do
    [[ ! -e $1/$file ]] || cmp "$1/$file" "$expected/$file" || return 1
  done
}
# Returns when the folder is there, or after ten seconds.
await() { local i; for ((i = 0; i < 2000; ++i)); do [[ -d $1 ]] && break; sleep 0.005; done; }
complete() { grep -q '"complete": true' "$1/report.json" 2>/dev/null; }

seq=$work/seq
"$program" simulate "$seq" --scans 24 --sensor vlp16 --quiet
begin=$(date +%s%N)
"$program" run "$seq" --out "$work/expected" --quiet
span=$((($(date +%s%N) - begin) / 1000))  # us
RANDOM=7

# kill_runs COUNT EXPECTED [FLAG...]: runs with these flags are killed at random moments, more than
# COUNT where a busy machine let all of them end before.
kill_runs() {
  local count=$1 expected=$2 early=0 broken=0
  shift 2
  echo "--- kill -9, $count times within $((span / 1000)) ms${*:+, $*}"
  for ((i = 0; i < count || (early + broken == 0 && i < count + 20); ++i)); do
    out=$work/out
    # Two of three runs resume the results of the run that was killed before.
    if ((i % 3 == 0)); then rm -rf "$out"; fi
    "$program" run "$seq" --out "$out" --resume --quiet "$@" &
    pid=$!
    delay=$(((RANDOM * 32768 + RANDOM) % span))
    sleep "$((delay / 1000000)).$(printf %06d $((delay % 1000000)))"
    kill -9 "$pid" 2>/dev/null || true
    wait "$pid" 2>/dev/null || true
    [[ -d $out ]] || { early=$((early + 1)); continue; }
    complete "$out" || broken=$((broken + 1))
    whole "$out" "$expected" || fail "kill $i left a damaged file"
    if complete "$out"; then
      same "$expected" "$out" || fail "kill $i: report.json claims what is not there"
    fi
    if ((i % 3 == 2)); then
      "$program" run "$seq" --out "$out" --resume --quiet "$@" || fail "kill $i: --resume"
      complete "$out" || fail "kill $i: not complete after --resume"
      same "$expected" "$out" || fail "kill $i: other bytes after --resume"
      [[ -z $(find "$out" -name '.*.tmp') ]] ||
        fail "kill $i: leftovers after --resume"
    fi
  done
  echo "$early of them before there was a folder, $broken before the run was complete"
  ((early + broken > 0)) || fail "no kill hit a run"
}
kill_runs "$kills" "$work/expected"

echo "--- kill -9 of --force: the earlier results, whole, or unfinished ones that --resume completes"
"$program" run "$seq" --out "$work/earlier" --end 9 --write-online --quiet
kept=0
broken=0
for ((i = 0; i < kills; ++i)); do
  rm -rf "$work/out"
  cp -r "$work/earlier" "$work/out"
  "$program" run "$seq" --out "$work/out" --force --quiet &
  pid=$!
  # One run of three is killed at any time, the others while new files replace earlier ones.
  delay=$(((RANDOM * 32768 + RANDOM) % span))
  if ((i % 3 > 0)); then
    while complete "$work/out" && kill -0 "$pid" 2>/dev/null; do :; done
    delay=$((RANDOM % 10000))
  fi
  sleep "$((delay / 1000000)).$(printf %06d $((delay % 1000000)))"
  kill -9 "$pid" 2>/dev/null || true
  wait "$pid" 2>/dev/null || true
  if complete "$work/out" && [[ -d $work/out/online ]]; then
    kept=$((kept + 1))
    # A kill while the new report is written leaves the temporary file of the report, too.
    diff -r -x .dynains_staging -x '.report.json.*.tmp' "$work/earlier" "$work/out" ||
      fail "kill $i of --force: changed"
    "$program" run "$seq" --out "$work/out" --end 9 --write-online --resume --quiet ||
      fail "kill $i of --force: earlier results are not complete"
    [[ -z $(find "$work/out" -name '.*.tmp' -o -name .dynains_staging) ]] ||
      fail "kill $i of --force: leftovers beside the earlier results"
    continue
  fi
  complete "$work/out" || broken=$((broken + 1))
  "$program" run "$seq" --out "$work/out" --resume --quiet || fail "kill $i of --force: --resume"
  same "$work/expected" "$work/out" || fail "kill $i of --force: other bytes after --resume"
  [[ -z $(find "$work/out" -name '.*.tmp' -o -name '.dynains_staging' -o -name online) ]] ||
    fail "kill $i of --force: leftovers after --resume"
done
echo "$kept of them left the earlier results, $broken unfinished ones"
((kept > 0 && broken > 0)) || fail "no kill of --force hit both"

echo "--- --resume after Ctrl-C; with other flags; when complete; --force after a kill"
# On a busy machine a run may end before the signal arrives. Such a run is repeated. A program that
# ignores the signal ends before it every time, and the test fails.
code=0
for ((attempt = 0; attempt < 20 && code == 0; ++attempt)); do
  rm -rf "$work/out"
  # In a script, `&` makes a command ignore SIGINT.
  env --default-signal=INT "$program" run "$seq" --out "$work/out" --quiet &
  pid=$!
  await "$work/out/labels"
  kill -INT "$pid"
  wait "$pid" || code=$?
done
[[ $code == 130 ]] || fail "Ctrl-C: exit code $code"
if "$program" run "$seq" --out "$work/out" --resume --window 3 --quiet 2>"$work/err"; then
  fail "--resume took the results of other flags"
fi
grep -q 'cannot be resumed' "$work/err" || fail "--resume with other flags: $(cat "$work/err")"
"$program" run "$seq" --out "$work/out" --resume --quiet || fail "--resume after Ctrl-C"
same "$work/expected" "$work/out" || fail "--resume after Ctrl-C: other bytes"
"$program" run "$seq" --out "$work/out" --resume | grep -q 'complete already' ||
  fail "--resume of a complete run has nothing to do"

echo "--- input that vanishes in the middle"
cp -r "$seq" "$work/vanishing"
"$program" run "$work/vanishing" --out "$work/vanished" --quiet 2>"$work/err" &
pid=$!
await "$work/vanished/labels"
rm -rf "$work/vanishing/velodyne"
code=0
wait "$pid" || code=$?
if [[ $code == 0 ]]; then
  echo "it was read before it vanished"
else
  [[ $code == 1 ]] || fail "vanishing input: exit code $code"
  grep -q 'dynains: error: .*bin' "$work/err" || fail "vanishing input: $(cat "$work/err")"
  ! complete "$work/vanished" || fail "vanishing input: called complete"
  whole "$work/vanished" || fail "vanishing input: damaged files"
fi

echo "--- a full disk"
mkdir "$disk"
if mount -t tmpfs -o size=600k tmpfs "$disk" 2>/dev/null; then
  code=0
  "$program" run "$seq" --out "$disk/out" --quiet 2>"$work/err" || code=$?
  [[ $code == 1 ]] || fail "full disk: exit code $code"
  grep -q 'No space left' "$work/err" || fail "full disk: $(cat "$work/err")"
  [[ ! -d $disk/out ]] || { whole "$disk/out" && ! complete "$disk/out"; } ||
    fail "full disk: damaged files"
  [[ -z $(find "$disk" -name '.*.tmp') ]] || fail "full disk: leftovers"
  mount -o remount,size=64m "$disk"
  "$program" run "$seq" --out "$disk/out" --resume --quiet || fail "full disk: --resume"
  same "$work/expected" "$disk/out" || fail "full disk: other bytes after --resume"

  rm -rf "$disk"/*
  cp -r "$work/expected" "$disk/out"

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
