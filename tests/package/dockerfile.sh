#!/usr/bin/env bash
# dockerfile.sh SOURCE BUILD WORK: the steps of .ci/Dockerfile, where no container runtime exists.
#
# RUN steps are executed with three differences: packages are looked up instead of installed, make
# touches the files instead of compiling them, and the program that is installed is that of the build
# folder BUILD. Then the program must run as a user without rights, and the packages of the second
# stage must have the libraries that it needs.
set -euo pipefail
source_dir=$1 build_dir=$2 work=$3
fail() { echo "Dockerfile: $*" >&2; exit 1; }

rm -rf "$work"
mkdir -p "$work"
image=$work/opt/dynains
# The folders of the image, here.
here() {
  sed "s#/source#<source>#g; s#/build#<build>#g; s#/opt/dynains#<image>#g
    s#<source>#$source_dir#g; s#<build>#$work/build#g; s#<image>#$image#g"
}

stages=0
declare -A packages=()
user='' created='' entry='' copied=''

apt-get() {
  [[ $1 == install ]] || return 0
  local word
  for word in "${@:2}"; do
    [[ $word == -* ]] && continue
    dpkg-query -W "$word" > /dev/null 2>&1 || apt-cache show "$word" > /dev/null 2>&1 ||
      fail "no package $word"
    packages[$stages]+=" $word"
  done
}
rm() { :; }
useradd() { created=${*: -1}; }
cmake() {
  case $1 in
    --build) command cmake "$@" -- -t ;;
    --install) command cmake --install "$build_dir" "${@:3}" ;;
    *) command cmake -G "Unix Makefiles" "$@" ;;
  esac
}

while read -r instruction arguments; do
  case $instruction in
    '' | '#'*) ;;
    FROM)
      [[ $arguments == debian:12-slim* ]] || fail "FROM $arguments: expected Debian 12"
      stages=$((stages + 1)) ;;
    RUN) eval "$(here <<< "$arguments")" ;;
    COPY) [[ $arguments != --from=build* ]] || copied=${arguments##* } ;;
    USER) user=$arguments ;;
    ENTRYPOINT) entry=$(tr -d '[]"' <<< "$arguments") ;;
    WORKDIR) ;;
    *) fail "unknown instruction $instruction" ;;
  esac
done < <(sed ':a; /\\$/ { N; s/\\\n//; ba }' "$source_dir/.ci/Dockerfile")

[[ $stages == 2 ]] || fail "$stages stages, expected 2"
[[ -n $user && $user == "$created" ]] || fail "user '$user', but '$created' is created"
[[ -n $copied && $entry == "$copied/bin/dynains" ]] || fail "'$entry' does not lie in '$copied'"
grep -q '^/build' "$source_dir/.dockerignore" || fail "build folders are copied"

# The first stage has what the program needs by cmake/dynainsParts.cmake.
needs=$(sed -n '/^dynains_part(program /,/)/p' "$source_dir/cmake/dynainsParts.cmake" |
  grep -o '=[a-z0-9-]*' | tr -d =)
common=$(sed -n 's/^set([a-z]* [A-Za-z_]*=\(.*-dev\))$/\1/p' "$source_dir/cmake/dynainsParts.cmake")
for package in libeigen3-dev $common $needs; do
  [[ " ${packages[1]} " == *" $package "* ]] || fail "the first stage lacks $package"
done

# A library belongs to the image if its files for developers are installed in the first stage.
program=$(here <<< "$entry")
[[ -x $program ]] || fail "$program was not installed"
owner_of() { { dpkg -S "$@" 2> /dev/null || true; } | head -1 | cut -d: -f1; }
objdump -p "$program" | awk '$1 == "NEEDED" { print $2 }' | while read -r library; do
  file=$(ldconfig -p | awk -v name="$library" '$1 == name && !found { found = 1; print $NF }')
  package=$(owner_of "$(readlink -f "$file")" "$file")
  developer=$(owner_of "*/${library%%.so*}.so")
  [[ -n $developer && " ${packages[1]} " == *" $developer "* ]] || continue
  [[ " ${packages[2]} " == *" $package "* ]] || fail "the second stage lacks $package ($library)"
  echo "$library: $package"
done

[[ $(id -u) == 0 ]] || { echo "SKIPPED: another user needs the rights of root"; exit 0; }
data=$(mktemp -d)
trap 'command rm -rf "$data"' EXIT
chown nobody "$data"
# The build folder need not be readable by others.
install -m 755 "$program" "$data/dynains"
cd "$data"
as_user() { setpriv --reuid=nobody --regid=nogroup --clear-groups "$@"; }
"$build_dir/bin/dynains_simulate" street --scans 5 --sensor vlp16 -q
as_user ./dynains run street --out cleaned --view -q
[[ -s cleaned/view.html ]] || fail "the program writes no page"
