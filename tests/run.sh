#!/usr/bin/env bash
# Installs what is missing, checks the format, builds and runs all tests; then fuzzes for some seconds (tests/fuzz/run.sh) and
# lints what was changed last (tests/tidy.sh). Works on a bare Debian 12 or 13, as root or with sudo.
#
#   tests/run.sh [--preset NAME] [--jobs N] [--no-install] [--tests-only] [-- CTEST_ARGUMENT...]
#
# Presets: release, debug, asan-ubsan, tsan, float64, werror, clang. Only a release is fuzzed and linted, and not with
# --tests-only or CTEST_ARGUMENTs: `tests/run.sh -- -R mesh` runs the tests whose names contain "mesh". --no-install leaves the
# packages alone. The last line printed is the verdict; the status is 0 if everything passed, 1 if not, 2 for arguments
# that make no sense.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

preset=release
jobs=$(nproc)
install=yes
whole=yes
ctest_arguments=()
while [ $# -gt 0 ]; do
  case $1 in
    --preset) preset=${2:-}; shift ;;
    --jobs) jobs=${2:-}; shift ;;
    --no-install) install=no ;;
    --tests-only) whole=no ;;
    --) shift; ctest_arguments=("$@"); break ;;
    -h | --help) sed -n '2,11s/^# \{0,1\}//p' tests/run.sh; exit 0 ;;
    *) echo "tests/run.sh: unknown argument '$1'; try --help" >&2; exit 2 ;;
  esac
  shift || true
done
if ! grep -q "\"name\": \"$preset\", \"configurePreset\"" CMakePresets.json; then
  echo "tests/run.sh: unknown preset '$preset'; there are: $(sed -n '/"buildPresets"/,/\]/s/.*"name": "\([^"]*\)".*/\1/p' CMakePresets.json | paste -sd' ')" >&2
  exit 2
fi
[ "$preset" = release ] && [ ${#ctest_arguments[@]} -eq 0 ] || whole=no
[[ $jobs =~ ^[1-9][0-9]*$ ]] || { echo "tests/run.sh: --jobs is '$jobs', must be a positive number" >&2; exit 2; }

stage="starting"
testing="testing with $jobs jobs"
log=$(mktemp)
finish() {
  local status=$?
  local summary
  summary=$(grep -E '^[0-9]+% tests passed' "$log" || true)
  rm -f "$log"
  if [ "$status" -eq 0 ]; then
    echo "tests/run.sh: PASSED ($preset, ${summary##*out of } tests, $SECONDS s)"
  elif [ "$stage" = "$testing" ] && [ -n "$summary" ]; then
    echo "tests/run.sh: FAILED ($preset, $summary, $SECONDS s)"
    exit 1
  else
    echo "tests/run.sh: FAILED while $stage ($preset, $SECONDS s)"
    exit 1
  fi
}
trap finish EXIT
trap 'exit 1' INT TERM
step() {
  stage=$1
  echo "tests/run.sh: $stage"
}

if [ "$install" = yes ]; then
  step "installing packages"
  packages=(tests)
  if [ $whole = yes ] || [ "$preset" = clang ]; then packages+=(clang); fi
  if [ $whole = yes ]; then packages+=(tidy); fi
  bash third_party_notes/install.sh "${packages[@]}"
fi
step "checking the format"
bash tests/format.sh
step "configuring build/$preset"
fresh=()  # a build from nothing takes half the time in few sources; one that is there stays as it is
[ -e "build/$preset" ] || fresh=(-D CMAKE_UNITY_BUILD=ON -D CMAKE_UNITY_BUILD_BATCH_SIZE=20)
cmake --preset "$preset" "${fresh[@]}" -D BULLET_PENALTY_BUILD_TESTS=ON -D BULLET_PENALTY_BUILD_DEMOS=ON
step "building with $jobs jobs"
cmake --build --preset "$preset" --parallel "$jobs"
step "$testing"
# A software renderer would otherwise start a thread for each core, in each of the parallel tests.
LP_NUM_THREADS=1 ctest --preset "$preset" --parallel "$jobs" --no-tests=error "${ctest_arguments[@]}" 2>&1 | tee "$log"
[ $whole = yes ] || exit 0
step "fuzzing with sanitizers"
bash tests/fuzz/run.sh --seconds 10 --seed 1 --jobs "$jobs"
step "linting"
bash tests/tidy.sh --seconds 20 --no-install --jobs "$jobs"
