#!/usr/bin/env bash
# third_party_notes/install.sh demos | tests [clang] [tidy]: installs the Debian packages that the demos need, or the tests with
# clang as a compiler and clang-tidy for tests/tidy.sh, and that are not there yet. Needs root, or sudo, only if
# something is missing. This is the one place that lists the packages; README.md beside it says what each of them is.
set -euo pipefail
say() { echo "install.sh: $*"; }

build=(g++ cmake ninja-build pkg-config libbullet-dev libeigen3-dev libpugixml-dev zlib1g-dev
       libgtest-dev)  # a plain configure includes the tests
demos=(libassimp-dev libcli11-dev nlohmann-json3-dev libpng-dev libstb-dev libgl-dev libegl1 libgl1-mesa-dri fonts-dejavu-core
       ffmpeg glmark2-data)
tests=(libbenchmark-dev parallel clang-format-19)
where_offered=(libosmesa6)  # Mesa gave it up in version 25.1: where it is gone, the demos draw with EGL

wanted=("${build[@]}" "${demos[@]}")
for what in "${@:-nothing}"; do
  case $what in
    demos) ;;
    tests) wanted+=("${tests[@]}") ;;
    clang) wanted+=(clang libclang-rt-dev) ;;
    tidy) wanted+=(clang-tidy-19) ;;
    *) echo "usage: $0 demos | tests [clang] [tidy]" >&2; exit 2 ;;
  esac
done

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  say "not a Debian system: nothing is installed. Needed, by their Debian names: ${wanted[*]}"
  exit 0
fi

is_installed() { [ "$(dpkg-query -W -f='${db:Status-Status}\n' "$1" 2>/dev/null | sort -u)" = installed ]; }
is_offered() { [[ $(apt-cache policy "$1" 2>/dev/null) == *"Candidate: "[!\(]* ]]; }
list_missing() {
  missing=()
  for package in "${wanted[@]}"; do
    is_installed "$package" || missing+=("$package")
  done
  for package in "${where_offered[@]}"; do
    is_installed "$package" || ! is_offered "$package" || missing+=("$package")
  done
}
list_missing
if [ ${#missing[@]} -eq 0 ]; then
  say "all ${#wanted[@]} packages are there"
  exit 0
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null; then
    say "not root, and there is no sudo. As root: apt-get install --no-install-recommends ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi

log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt() {  # quiet unless it fails
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o Dpkg::Use-Pty=0 -o Acquire::Retries=3 "$@" >"$log" 2>&1 || {
    tail -n 20 "$log" >&2
    say "apt-get $1 failed" >&2
    exit 1
  }
}
say "updating the package lists"
apt update
list_missing  # only now is it known what is offered
say "missing: ${missing[*]}"
apt install --no-install-recommends --simulate "${missing[@]}"
say "installing $(grep -c '^Inst ' "$log" || true) packages with all they depend on: some minutes"
start=$SECONDS
apt install --no-install-recommends "${missing[@]}"
say "installed in $((SECONDS - start)) s"
