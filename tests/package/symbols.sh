#!/usr/bin/env bash
# symbols.sh LIBRARY...: each function and variable of namespace penalty has one definition in these libraries, or is inline
# wherever it is defined. Two strong ones collide as soon as a program needs both objects; of a strong and a weak one, which a
# program gets depends on what else it links. Status 1, and a line for each symbol of that kind.
set -euo pipefail
[ $# -gt 0 ] || { echo "usage: symbols.sh LIBRARY..." >&2; exit 2; }
for library in "$@"; do
  [ -f "$library" ] || { echo "symbols.sh: there is no $library" >&2; exit 2; }
done

# Lines "library[member]: address type symbol"; a shared library has no member.
nm --defined-only -A "$@" 2>/dev/null | awk '
  NF < 3 { next }
  { type = $(NF - 1); symbol = $NF; where = $1; sub(/:[0-9a-f]*$/, "", where); sub(/.*\//, "", where) }
  symbol !~ /^_Z(T[VTIS])?N[KVrRO]*7penalty/ { next }
  type ~ /^[TDBRG]$/ { strong[symbol]++; places[symbol] = places[symbol] "\n    strong in " where }
  type ~ /^[WVu]$/ { weak[symbol]++; if (weak[symbol] == 1) places[symbol] = places[symbol] "\n    weak in " where }
  { count++ }
  END {
    if (!count) { print "no symbol of namespace penalty in these libraries"; exit 1 }
    for (symbol in strong)
      if (strong[symbol] > 1 || symbol in weak) { print symbol " is defined more than once:" places[symbol]; bad = 1 }
    exit bad
  }' | c++filt
