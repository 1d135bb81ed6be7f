#!/usr/bin/env bash
# Installs what is missing, builds, and runs the whole test suite.
#
#   scripts/test.sh [--lint]     --lint: also formatter, and linter on what the last 2 commits changed
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

lint=false
for argument in "$@"; do
  if [[ $argument != --lint ]]; then
    echo "test.sh: unknown argument '$argument'; expected --lint" >&2
    exit 2
  fi
  lint=true
done

dependencies=(--test)
if $lint; then dependencies+=(--lint); fi
scripts/install_dependencies.sh "${dependencies[@]}"
scripts/build.sh
# What changed lately; all of it takes as long as a third of the build, and is for before a commit.
if $lint; then scripts/lint.sh --since HEAD~2; fi

jobs=$(nproc)
echo "test: running with $jobs jobs"
ctest --preset release -j "$jobs" --output-on-failure --no-tests=error
echo "test: all passed"
