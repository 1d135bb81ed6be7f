#!/usr/bin/env bash
# Writes etalon.1 and etalon-COMMAND.1 for every command from what --help prints.
#
#   man_pages.sh HELP2MAN ETALON FOLDER
set -euo pipefail
[[ $# == 3 ]] || { sed -n '2,4p' "$0"; exit 2; }
help2man=$1 etalon=$2 folder=$3
mkdir -p "$folder"
page() { # NAME SUMMARY COMMAND...
  local name=$1 summary=$2
  shift 2
  "$help2man" --no-info --section 1 --name "$summary" --version-string "$("$etalon" --version)" --output "$folder/$name.1" "$*"
  gzip -9nf "$folder/$name.1"
}
page etalon "stereo-inertial odometry with pluggable initializers" "$etalon"
"$etalon" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z][a-z-]*\) *\([^.:]*\).*/\1\t\2/p' |
  while IFS=$'\t' read -r command summary; do page "etalon-$command" "$summary" "$etalon" "$command"; done
