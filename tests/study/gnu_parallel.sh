#!/usr/bin/env bash
# gnu_parallel.sh STUDY DIR: two workers of GNU parallel share out the suite quick in four parts; the table of their
# results is that of one go.
set -euo pipefail
study=$1
rm -rf "$2"
mkdir -p "$2"
cd "$2"
export HOME=$PWD  # where GNU parallel keeps its notes

"$study" run --suite quick --out one_go --jobs 1
parallel -j2 "$study" run --suite quick --shard {}/4 --jobs 1 --out parts ::: 1 2 3 4
[ "$(find parts -name 'results-*-of-4.jsonl' | wc -l)" -eq 4 ]
"$study" table one_go >one_go.txt
"$study" table parts >parts.txt
grep -q '^static ' one_go.txt
cmp one_go.txt parts.txt
