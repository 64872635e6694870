#!/usr/bin/env bash
# Runs clang-tidy, with the checks and names of .clang-tidy, over every source of the tree and the headers that it includes.
#
#   tests/tidy.sh [--minutes N | --seconds N] [--jobs N] [--no-install] [PATH...]
#
# With paths, only over the sources below them: `tests/tidy.sh plugin demos/main`. All of them take most of an hour on two
# cores: with --minutes or --seconds it begins with those that were changed last, and begins none after that time. The last line printed
# is the verdict; the status is 0 if nothing was found, 1 if something was, 2 for arguments that make no sense.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
tidy=clang-tidy-19  # versions find different things; Debian 12 and 13 have this one both

jobs=$(nproc)
duration=
install=yes
paths=()
while [ $# -gt 0 ]; do
  case $1 in
    --jobs) jobs=${2:-}; shift ;;
    --minutes | --seconds) unit=$1 duration=${2:-x}; shift ;;
    --no-install) install=no ;;
    -h | --help) sed -n '2,8s/^# \{0,1\}//p' tests/tidy.sh; exit 0 ;;
    -*) echo "tests/tidy.sh: unknown argument '$1'; try --help" >&2; exit 2 ;;
    *) [ -e "$1" ] || { echo "tests/tidy.sh: there is no '$1' in the tree" >&2; exit 2; }; paths+=("${1%/}") ;;
  esac
  shift || true
done
[[ ${duration:-1} =~ ^[1-9][0-9]*$ ]] || { echo "tests/tidy.sh: $unit is '${duration#x}', must be a positive number" >&2; exit 2; }
[[ $jobs =~ ^[1-9][0-9]*$ ]] || { echo "tests/tidy.sh: --jobs is '$jobs', must be a positive number" >&2; exit 2; }
[ ${#paths[@]} -gt 0 ] || paths=(plugin demos tests)

if [ "$install" = yes ]; then
  echo "tests/tidy.sh: installing packages"
  bash third_party_notes/install.sh tests tidy
fi
# Compile commands without precompiled headers, which are of another compiler. Nothing is built.
echo "tests/tidy.sh: configuring build/tidy"
cmake --preset release -B build/tidy -D CMAKE_DISABLE_PRECOMPILE_HEADERS=ON -D BULLET_PENALTY_BUILD_TESTS=ON \
  -D BULLET_PENALTY_BUILD_DEMOS=ON >/dev/null
mapfile -t sources < <(sed -n 's/^ *"file": "\(.*\)",\{0,1\}$/\1/p' build/tidy/compile_commands.json | sort -u |
                       grep -E "^$PWD/($(IFS='|'; echo "${paths[*]}"))(/|\$)")
[ ${#sources[@]} -gt 0 ] || { echo "tests/tidy.sh: no source is compiled below ${paths[*]}" >&2; exit 2; }
total=${#sources[@]}
deadline=$((1 << 40))
if [ -n "$duration" ]; then
  [ "$unit" = --seconds ] || duration=$((60 * duration))
  deadline=$(($(date +%s) + duration))
  mapfile -t sources < <({ git log --max-count=100 --format= --name-only 2>/dev/null | sed "s|^|$PWD/|" || true
                           printf '%s\n' "${sources[@]}"; } | awk '!seen[$0]++' |
                         grep -Fxf <(printf '%s\n' "${sources[@]}"))
fi
echo "tests/tidy.sh: $total sources with $jobs jobs"
log=$(mktemp)
done=$(mktemp)
trap 'rm -f "$log" "$done"' EXIT
lint() {
  [ "$(date +%s)" -lt "$deadline" ] || return 0
  echo >>"$done"
  "$tidy" --quiet -p build/tidy "$1" 2>/dev/null
}
export -f lint
export deadline done tidy
# Each finding once, although a header is seen by many sources, and at once.
once() {
  declare -A seen
  local show= line
  while IFS= read -r line; do
    if [[ $line =~ ^/.*:\ (warning|error):\  ]]; then
      show=${seen[$line]-yes}
      seen[$line]=
    fi
    [ -z "$show" ] || printf '%s\n' "$line"
  done
}
passed=yes
printf '%s\0' "${sources[@]}" | xargs -0 -n 1 -P "$jobs" bash -c 'lint "$0"' | once | tee "$log" || passed=no
linted="$(wc -l <"$done") of $total sources, $SECONDS s"
if [ $passed = yes ] && ! [ -s "$log" ]; then
  echo "tests/tidy.sh: PASSED ($linted)"
else
  echo "tests/tidy.sh: FAILED ($(grep -cE '^/.*: (warning|error): ' "$log" || true) findings in $linted)"
  exit 1
fi
