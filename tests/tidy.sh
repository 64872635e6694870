#!/usr/bin/env bash
# Runs clang-tidy, with the checks and names of .clang-tidy, over every source of the tree and the headers that it includes.
#
#   tests/tidy.sh [--jobs N] [--no-install] [PATH...]
#
# With paths, only over the sources below them: `tests/tidy.sh plugin demos/main`. The last line printed is the verdict; the
# status is 0 if nothing was found, 1 if something was, 2 for arguments that make no sense.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
tidy=clang-tidy-19  # versions find different things; Debian 12 and 13 have this one both

jobs=$(nproc)
install=yes
paths=()
while [ $# -gt 0 ]; do
  case $1 in
    --jobs) jobs=${2:-}; shift ;;
    --no-install) install=no ;;
    -h | --help) sed -n '2,7s/^# \{0,1\}//p' tests/tidy.sh; exit 0 ;;
    -*) echo "tests/tidy.sh: unknown argument '$1'; try --help" >&2; exit 2 ;;
    *) [ -e "$1" ] || { echo "tests/tidy.sh: there is no '$1' in the tree" >&2; exit 2; }; paths+=("${1%/}") ;;
  esac
  shift || true
done
[[ $jobs =~ ^[1-9][0-9]*$ ]] || { echo "tests/tidy.sh: --jobs is '$jobs', must be a positive number" >&2; exit 2; }
[ ${#paths[@]} -gt 0 ] || paths=(plugin demos tests)

if [ "$install" = yes ]; then
  echo "tests/tidy.sh: installing packages"
  bash third_party_notes/install.sh tidy
fi
# Compile commands without precompiled headers, which are of another compiler. Nothing is built.
echo "tests/tidy.sh: configuring build/tidy"
cmake --preset release -B build/tidy -D CMAKE_DISABLE_PRECOMPILE_HEADERS=ON -D BULLET_PENALTY_BUILD_TESTS=ON \
  -D BULLET_PENALTY_BUILD_DEMOS=ON >/dev/null
mapfile -t sources < <(sed -n 's/^ *"file": "\(.*\)",\{0,1\}$/\1/p' build/tidy/compile_commands.json | sort -u |
                       grep -E "^$PWD/($(IFS='|'; echo "${paths[*]}"))(/|\$)")
[ ${#sources[@]} -gt 0 ] || { echo "tests/tidy.sh: no source is compiled below ${paths[*]}" >&2; exit 2; }
echo "tests/tidy.sh: ${#sources[@]} sources with $jobs jobs"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
# Each finding once, although a header is seen by many sources.
if printf '%s\0' "${sources[@]}" |
  xargs -0 -n 1 -P "$jobs" "$tidy" --quiet -p build/tidy 2>/dev/null |
  awk '/^\/.*: (warning|error): / { show = !seen[$0]++ } show { print; fflush() }' | tee "$log" && ! [ -s "$log" ]; then
  echo "tests/tidy.sh: PASSED (${#sources[@]} sources, $SECONDS s)"
else
  echo "tests/tidy.sh: FAILED ($(grep -cE '^/.*: (warning|error): ' "$log" || true) findings in ${#sources[@]} sources, $SECONDS s)"
  exit 1
fi
