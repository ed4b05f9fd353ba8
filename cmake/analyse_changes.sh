#!/usr/bin/env bash
# analyse_changes.sh BUILD RUN_CLANG_TIDY CPPCHECK...: analyses the files of include/ and src/ that
# differ from a commit whose files were all analysed: $CI_BASE, or else the one in .ci/analysed.
# Everything is analysed if this clone does not have that commit, or if the checks changed. BUILD is
# complete: its lists of dependencies tell which units include a header. clang-tidy reads each
# changed file in one unit.
set -euo pipefail
build=$1 run_clang_tidy=$2
shift 2
base=${CI_BASE:-$(cat .ci/analysed 2>/dev/null || true)}
if [[ -z $base ]] || ! git cat-file -e "$base^{commit}" 2>/dev/null; then
  echo "no commit to compare with: all files are analysed"
  exec cmake --build "$build" --target analysis
fi
if ! git diff --quiet "$base" -- .clang-tidy .cppcheck cmake/dynainsAnalysis.cmake; then
  echo "the checks differ from those of $base: all files are analysed"
  exec cmake --build "$build" --target analysis
fi
mapfile -t changed < <(
  git diff --name-only --diff-filter=d "$base" -- 'include/*.hpp' 'src/*.hpp' 'src/*.cpp'
  git ls-files --others --exclude-standard -- 'include/*.hpp' 'src/*.hpp' 'src/*.cpp')
echo "${#changed[@]} files differ from $base"
((${#changed[@]} > 0)) || exit 0
"$@" -j2 "${changed[@]}"
# A template has findings only where it is used: all of the pipeline is read by one file.
[[ " ${changed[*]}" != *" include/"* ]] || "$@" -I include src/remover/remover.cpp

mapfile -t lists < <(find "$build/src" -name '*.o.d')
((${#lists[@]} > 0)) || { echo "$build is not built" >&2; exit 1; }
units=()
for file in "${changed[@]}"; do
  found=$(grep -lF "/$file" "${lists[@]}" || true)
  if [[ -z $found ]]; then
    echo "no unit of the build has $file"
    continue
  fi
  taken=no
  for unit in "${units[@]}"; do
    [[ $'\n'$found$'\n' != *$'\n'"$unit"$'\n'* ]] || taken=yes
  done
  [[ $taken == yes ]] || units+=("$(head -n 1 <<< "$found")")
done
# The first file of a list of dependencies is the unit itself.
mapfile -t sources < <(for unit in "${units[@]}"; do
  tr -d '\\\n' < "$unit" | awk '{ print "/" $2 "$" }'
done | sed -E 's|^/(/\|(\.\./)+)|/|')
((${#sources[@]} == 0)) ||
  "$run_clang_tidy" -quiet -p "$build" -extra-arg=-std=c++17 "${sources[@]}"
