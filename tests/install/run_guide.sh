#!/usr/bin/env bash
# Does what docs/writing-a-plugin.md says: writes its files into an empty folder and runs its commands.
#   run_guide.sh GUIDE EXAMPLE WORK     with ETALON, the installed prefix, in the environment
# Blocks "```LANGUAGE FILE" are appended to FILE, blocks "```sh" are run, in the order of the page. In the end the files
# must be those of EXAMPLE.
set -euo pipefail
guide=$1 example=$2 work=$3
rm -rf "$work"
mkdir -p "$work"
awk '
  /^```/ && inside { if (file) print "END_OF_FILE"; inside = 0; next }
  /^```/ {
    inside = 1; file = $2; wanted = $1 == "```sh" || file
    if (file) { print "cat >> " file " << \"END_OF_FILE\"" }
    next
  }
  inside && wanted { print }
' "$guide" > "$work/commands.sh"
cd "$work"
PS4='$ ' bash -euxo pipefail commands.sh
diff -r --exclude=build --exclude=flight --exclude=run "$example" "$work/loosely_coupled"
