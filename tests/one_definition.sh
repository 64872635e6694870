#!/usr/bin/env bash
# Fails if libraries that are linked together define a symbol of namespace penalty twice, once strongly: which of the two
# a program gets then depends on what else it links.
#
#   tests/one_definition.sh NM LIBRARY...
set -euo pipefail
nm=$1
shift
[ $# -gt 0 ] || { echo "one_definition.sh: no libraries" >&2; exit 2; }
"$nm" --extern-only --defined-only "$@" | awk '
  NF == 3 && $3 ~ /7penalty/ {
    ++symbols
    if ($2 ~ /[TDBRi]/) ++strong[$3]; else ++weak[$3]
  }
  END {
    for (name in strong)
      if (strong[name] > 1 || weak[name] > 0) {
        print name ": " strong[name] " strong and " weak[name] + 0 " weak definitions"
        twice = 1
      }
    if (symbols < 100) {
      print "only " symbols + 0 " symbols of namespace penalty found: nothing was looked at"
      twice = 1
    }
    exit twice
  }' | c++filt
