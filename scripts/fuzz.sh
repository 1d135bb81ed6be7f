#!/usr/bin/env bash
# Feeds every reader, the pipeline and the plugin loader with broken input (libFuzzer, address and undefined-behaviour sanitizers).
#
#   scripts/fuzz.sh [--seed N] [SECONDS] [NAME]...
#
# SECONDS for each fuzzer (default 450: an hour in all), two at a time; NAMEs of tests/fuzz/NAME_fuzz.cpp (default: all). Begins
# with the inputs in tests/fuzz/corpus/NAME and keeps what it finds in build/fuzz/corpus/NAME. An input that crashes, hangs for 20 s,
# leaks or needs more than 6 GB is kept in build/fuzz/NAME-*, and the exit code is 1. With a seed the inputs are the same every time.
#
#   scripts/fuzz.sh --keep        the least part of what was found that covers as much goes to tests/fuzz/corpus
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

keep=false seconds=450 seed=0
if [[ ${1:-} == --seed ]]; then
  seed=$2
  shift 2
fi
if [[ ${1:-} == --keep ]]; then
  keep=true
  shift
elif [[ ${1:-} =~ ^[0-9]+$ ]]; then
  seconds=$1
  shift
fi
names=("$@")
if ((${#names[@]} == 0)); then
  for source in tests/fuzz/*_fuzz.cpp; do names+=("$(basename "$source" _fuzz.cpp)"); done
fi
for name in "${names[@]}"; do
  [[ -f tests/fuzz/${name}_fuzz.cpp ]] || {
    echo "fuzz.sh: there is no tests/fuzz/${name}_fuzz.cpp; expected [--seed N] [SECONDS] [NAME]... or --keep" >&2
    exit 2
  }
done

scripts/install_dependencies.sh --fuzz
echo "fuzz: building"
cmake --preset fuzz >/dev/null
cmake --build --preset fuzz -j "$(nproc)" | grep -E "error|FAILED|warning" || true
bin=build/fuzz/bin

# Libraries without sanitizers fill containers that ours read: no check of their bounds.
export ASAN_OPTIONS=detect_container_overflow=0:allocator_may_return_null=1 UBSAN_OPTIONS=print_stacktrace=1
# MRPT makes room for a text of any length that a damaged log states: up to 4 GB.
run() { # NAME SECONDS
  mkdir -p "build/fuzz/corpus/$1" "tests/fuzz/corpus/$1"
  if "$bin/etalon_fuzz_$1" "build/fuzz/corpus/$1" "tests/fuzz/corpus/$1" -seed="$seed" -max_total_time="$2" -timeout=20 -rss_limit_mb=6000 -malloc_limit_mb=0 \
    -max_len=65536 -artifact_prefix="build/fuzz/$1-" -print_final_stats=1 -verbosity=0 >"build/fuzz/$1.log" 2>&1; then
    echo "fuzz: $1: $(awk '/number_of_executed_units/ {print $2}' "build/fuzz/$1.log") inputs, nothing found"
  else
    echo "fuzz: $1: FAILED, build/fuzz/$1.log:"
    tail -n 40 "build/fuzz/$1.log"
    return 1
  fi
}
export -f run
export bin seed

if $keep; then
  for name in "${names[@]}"; do
    mkdir -p "tests/fuzz/corpus/$name"
    "$bin/etalon_fuzz_$name" -merge=1 "tests/fuzz/corpus/$name" "build/fuzz/corpus/$name" >"build/fuzz/$name.log" 2>&1
    echo "fuzz: $name: $(find "tests/fuzz/corpus/$name" -type f | wc -l) inputs kept"
  done
  exit 0
fi
echo "fuzz: $seconds s each: ${names[*]}"
printf '%s\n' "${names[@]}" | xargs -P "$(nproc)" -I {} bash -c 'run "$1" "$2"' _ {} "$seconds"
echo "fuzz: clean"
