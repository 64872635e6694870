#!/usr/bin/env bash
# Looks for crashes, undefined behaviour, leaks and broken promises for as long as it is told: every reader under
# libFuzzer, random sequences of calls and allocations that fail, all built by clang with its address and
# undefined-behaviour sanitizers.
#
#   tests/fuzz/run.sh [--minutes N | --seconds N] [--jobs N] [--seed N] [--only NAME]
#
# --minutes (default 10) or --seconds is the time for each of the readers and, for each of Bullet's builds, for the sequences.
# Less than a minute is for Bullet in single precision alone, and of the allocations every seventh fails. As many as there
# are --jobs run at once; --only runs one of vtk, gmsh, tetgen, ply, obj, stl, sequences, allocations. Sequences begin with
# --seed (default: the time, so that no two runs are the same). Wants clang, and what tests/run.sh installs. What the fuzzers
# learned stays in build/fuzz/corpus and is where the next run starts; inputs that were found out are kept in
# build/fuzz/found, and
#
#   build/fuzz/tests/fuzz/fuzz_FORMAT FILE
#   build/fuzz/tests/fuzz/api_sequences_PRECISION --seed N --log
#
# repeat one of them. The last line is the verdict; the status is 0 if nothing was found, 1 if something was, 2 for
# arguments that make no sense.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

readers=(vtk gmsh tetgen ply obj stl)
duration=600
jobs=$(nproc)
seed=$(date +%s)
only=
while [ $# -gt 0 ]; do
  option=$1
  case $option in
    --minutes | --seconds) duration=${2:-} ;;
    --jobs) jobs=${2:-} ;;
    --seed) seed=${2:-} ;;
    --only) only=${2:-} ;;
    -h | --help) sed -n '2,19s/^# \{0,1\}//p' tests/fuzz/run.sh; exit 0 ;;
    *) echo "tests/fuzz/run.sh: unknown argument '$1'; try --help" >&2; exit 2 ;;
  esac
  shift $(($# > 1 ? 2 : 1))
  for number in "$duration" "$jobs" "$seed"; do
    [[ $number =~ ^[1-9][0-9]*$ ]] || { echo "tests/fuzz/run.sh: $option: '$number' is not a positive number" >&2; exit 2; }
  done
  [ "$option" != --minutes ] || duration=$((60 * duration))
done
case " ${readers[*]} sequences allocations " in
  *" ${only:-vtk} "*) ;;
  *) echo "tests/fuzz/run.sh: --only is '$only', must be one of ${readers[*]} sequences allocations" >&2; exit 2 ;;
esac

precisions=(float float64) stride=1
[ "$duration" -ge 60 ] || precisions=(float) stride=7
cmake --preset fuzz -D BULLET_PENALTY_PRECISIONS="$(IFS=';'; echo "${precisions[*]}")"
cmake --build --preset fuzz --target fuzz_programs --parallel "$jobs"
programs=build/fuzz/tests/fuzz
mkdir -p build/fuzz/corpus build/fuzz/found
"$programs/write_samples" build/fuzz/corpus

# Files of the size of a line or two: in memory, where there is such a directory.
TMPDIR=$(mktemp -d -p "$([ -w /dev/shm ] && echo /dev/shm || echo /tmp)" penalty-fuzz-XXXXXX)
export TMPDIR
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$TMPDIR"' EXIT

# Begins as soon as a job is free; says what it printed when it is done.
try() {  # NAME COMMAND...
  local name=$1
  shift
  [ -z "$only" ] || [ "$only" = "${name%%_*}" ] || return 0
  while [ "$(jobs -pr | wc -l)" -ge "$jobs" ]; do wait -n || true; done
  {
    "$@" >"$TMPDIR/$name.log" 2>&1 || touch "$TMPDIR/$name.found"
    sed "s/^/$name: /" "$TMPDIR/$name.log"
  } &
}
for precision in "${precisions[@]}"; do  # takes longest
  try "allocations_$precision" "$programs/nth_allocation_$precision" --stride "$stride"
done
for reader in "${readers[@]}"; do
  leaks=1 memory=1024  # [MB]
  # Leaks are looked for after each input that may have leaked. Assimp does so with every other broken file: it is looked at
  # once, at the end, and may pile up what it has lost.
  case $reader in obj | stl) leaks=0 memory=16384 ;; esac
  try "$reader" "$programs/fuzz_$reader" -max_total_time="$duration" -max_len=4096 -timeout=20 \
    -rss_limit_mb=$memory -malloc_limit_mb=1024 -detect_leaks=$leaks -print_final_stats=1 -print_funcs=0 -verbosity=0 \
    -artifact_prefix="build/fuzz/found/$reader-" "build/fuzz/corpus/$reader"
done
for precision in "${precisions[@]}"; do
  try "sequences_$precision" "$programs/api_sequences_$precision" --seed "$seed" --count 1000000000 --seconds "$duration"
done
wait

found=$(cd "$TMPDIR" && ls -- *.found 2>/dev/null | sed 's/\.found$//' | paste -sd' ' || true)
if [ -z "$found" ]; then
  echo "tests/fuzz/run.sh: PASSED ($duration s each, seed $seed, $SECONDS s)"
else
  echo "tests/fuzz/run.sh: FAILED ($found; $duration s each, seed $seed, $SECONDS s)"
  exit 1
fi
