#!/usr/bin/env bash
# Installs what is missing, builds penalty-demo and runs every scene at preview quality into demos/out/<scene>/: a still,
# a clip, a summary, energies as a table and as curves. Works on a bare Debian 12 or 13, as root or with sudo.
#
#   demos/run.sh [--jobs N] [--no-install] [-- ARGUMENT...]
#
# --no-install leaves the packages alone. Arguments after -- go to every run: `demos/run.sh -- --quality video`. The last line
# printed is the verdict; the status is 0 if every scene ran, 1 if not, 2 for arguments that make no sense.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

jobs=$(nproc)
install=yes
arguments=()
while [ $# -gt 0 ]; do
  case $1 in
    --jobs) jobs=${2:-}; shift ;;
    --no-install) install=no ;;
    --) shift; arguments=("$@"); break ;;
    -h | --help) sed -n '2,8s/^# \{0,1\}//p' demos/run.sh; exit 0 ;;
    *) echo "demos/run.sh: unknown argument '$1'; try --help" >&2; exit 2 ;;
  esac
  shift || true
done
[[ $jobs =~ ^[1-9][0-9]*$ ]] || { echo "demos/run.sh: --jobs is '$jobs', must be a positive number" >&2; exit 2; }

stage="starting"
failed=()
count=0
finish() {
  local status=$?
  if [ "$status" -ne 0 ]; then
    echo "demos/run.sh: FAILED while $stage ($SECONDS s)"
    exit 1
  elif [ ${#failed[@]} -gt 0 ]; then
    echo "demos/run.sh: FAILED in scene ${failed[*]} ($SECONDS s)"
    exit 1
  fi
  echo "demos/run.sh: PASSED ($count scenes in demos/out, $SECONDS s)"
}
trap finish EXIT
trap 'exit 1' INT TERM
step() {
  stage=$1
  echo "demos/run.sh: $stage"
}

if [ "$install" = yes ]; then
  step "installing packages"
  bash third_party_notes/install.sh demos
fi
step "configuring build/release"
cmake --preset release -D BULLET_PENALTY_BUILD_TESTS=ON -D BULLET_PENALTY_BUILD_DEMOS=ON  # as tests/run.sh does: one build serves both
step "building penalty-demo with $jobs jobs"
cmake --build --preset release --parallel "$jobs" --target penalty-demo penalty-demo-float64

demo=build/release/demos/main/penalty-demo
read -r -d '' -a scenes < <("$demo" list | cut -d ' ' -f 1 && printf '\0')
for scene in "${scenes[@]}"; do
  count=$((count + 1))
  step "running scene $count of ${#scenes[@]}: $scene"
  rm -rf "demos/out/$scene"
  "$demo" run "$scene" --out "demos/out/$scene" ${arguments[@]+"${arguments[@]}"} || failed+=("$scene")
done
