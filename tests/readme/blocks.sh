#!/usr/bin/env bash
# The code blocks of a Markdown file that are tests. A block of the languages bash, cpp or cmake is marked on the line
# directly above its fence, either as a test or with the reason why it is none:
#
#     <!-- test: NAME -->             NAME: letters, digits and underscores, once in the file
#     <!-- not tested: REASON -->
#
# bash   runs with -euo pipefail in an empty directory, the demo programs on the PATH; must end with status 0.
# cpp    is compiled for each precision of Bullet that was built; with a main function it is also run and must return 0,
#        without one it is code at namespace scope.
# cmake  is the rest of a project that has an executable `app`; configured and built against the installed package.
#
#   blocks.sh FILE list          a line for each test: language, name, line of its first code line
#   blocks.sh FILE show NAME     the code of one test
#   blocks.sh FILE run NAME DIR  runs a bash block in the fresh directory DIR
#   blocks.sh FILE check         status 1, and a line each, for blocks without a mark and for names used twice
set -euo pipefail
file=$1 command=$2

# One pass over the file, `wanted` saying what to print.
scan() {
  awk -v wanted="$1" -v name="${2:-}" '
    !inside && /^ *```[a-z]/ {
      language = $0; gsub(/[` ]/, "", language)
      inside = 1
      tested = mark ~ /^<!-- test: [A-Za-z0-9_]+ -->$/ ? mark : ""
      gsub(/^<!-- test: | -->$/, "", tested)
      ours = language ~ /^(bash|cpp|cmake)$/
      if (wanted == "list" && ours && tested != "") print language, tested, NR + 1
      if (wanted == "check" && ours && tested == "" && mark !~ /^<!-- not tested: .+ -->$/) {
        print FILENAME ":" NR ": this " language " block has no test mark above it"; bad = 1
      }
      if (wanted == "check" && tested != "" && seen[tested]++) {
        print FILENAME ":" NR ": a second test of the name " tested; bad = 1
      }
      next
    }
    inside && /^ *```$/ { inside = 0; mark = ""; next }
    inside { if (wanted == "show" && tested == name) { print; found = 1 } next }
    { mark = $0 }
    END { if (bad || (wanted == "show" && !found)) exit 1 }
  ' "$file"
}

case $command in
  list | check) scan "$command" ;;
  show) scan show "$3" || { echo "$file has no test '$3'" >&2; exit 1; } ;;
  run)
    code=$(scan show "$3")
    rm -rf "$4"
    mkdir -p "$4"
    cd "$4"
    HOME=$PWD bash -euxo pipefail -c "$code"
    ;;
  *) echo "blocks.sh: unknown command '$command'" >&2; exit 2 ;;
esac
