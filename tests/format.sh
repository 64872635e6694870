#!/usr/bin/env bash
# Checks that clang-format leaves every source as it is; with --mend it writes what it wants instead. Versions disagree about
# details, so that it is always the same one, which Debian 12 and 13 have both: where it is missing, nothing is checked.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
formatter=clang-format-19

case ${1:---check} in
  --check) arguments=(--dry-run --Werror) ;;
  --mend) arguments=(-i) ;;
  *) echo "usage: tests/format.sh [--check|--mend]" >&2; exit 2 ;;
esac
if ! command -v "$formatter" >/dev/null; then
  echo "tests/format.sh: no $formatter here: the format is not checked"
  exit 0
fi
find plugin demos tests -name '*.h' -print0 -o -name '*.cpp' -print0 | xargs -0 "$formatter" "${arguments[@]}" || {
  echo "tests/format.sh: mend it with tests/format.sh --mend" >&2
  exit 1
}
