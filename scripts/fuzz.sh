#!/usr/bin/env bash
# Feeds every reader, the pipeline and the plugin loader with broken input (libFuzzer, address and undefined-behaviour sanitizers).
#
#   scripts/fuzz.sh [--seed N] [SECONDS] [NAME]...
#
# SECONDS for each fuzzer (default 360: an hour in all), one a core at a time; NAMEs of tests/fuzz/NAME_fuzz.cpp (default: all). Begins
# with the inputs in tests/fuzz/corpus/NAME and keeps what it finds in build/fuzz/corpus/NAME. An input that crashes, hangs for 20 s,
# leaks, or needs more than 2 GB in all or 256 MB at once is kept in build/fuzz/NAME-*, and the exit code is 1. With a seed the inputs
# are nearly the same every time.
#
#   scripts/fuzz.sh --keep [NAME]...   the least part of what was found, of up to 1 KB each and without a path of this machine, that
#                                      reaches as much goes to tests/fuzz/corpus
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

folder=build/fuzz keep=false seconds=360 seed=0 jobs=$(nproc)
while [[ ${1:-} == --* ]]; do
  case "$1" in
    --keep) keep=true ;;
    --seed)
      seed=${2:?fuzz.sh: expected a number behind --seed}
      shift
      ;;
    *)
      echo "fuzz.sh: unknown argument '$1'; expected --seed N or --keep" >&2
      exit 2
      ;;
  esac
  shift
done
if [[ ${1:-} =~ ^[0-9]+$ ]]; then
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
cmake --build --preset fuzz -j "$(nproc)" >"$folder/build.log" 2>&1 || {
  echo "fuzz: the build failed, $folder/build.log:" >&2
  grep -E "error|FAILED" "$folder/build.log" >&2 || tail -n 40 "$folder/build.log" >&2
  exit 1
}
grep "warning" "$folder/build.log" || true

# Libraries without sanitizers fill containers that ours read: no check of their bounds.
export ASAN_OPTIONS=detect_container_overflow=0:allocator_may_return_null=1 UBSAN_OPTIONS=print_stacktrace=1
run() { # NAME
  mkdir -p "$folder/corpus/$1" "tests/fuzz/corpus/$1"
  if "$folder/bin/etalon_fuzz" --target="$1" "$folder/corpus/$1" "tests/fuzz/corpus/$1" -seed="$seed" -max_total_time="$seconds" -timeout=20 \
    -rss_limit_mb=2000 -malloc_limit_mb=256 -max_len=65536 -artifact_prefix="$folder/$1-" -print_final_stats=1 -verbosity=0 \
    >"$folder/$1.log" 2>&1; then
    echo "fuzz: $1: $(awk '/number_of_executed_units/ {print $2}' "$folder/$1.log") inputs, nothing found"
  else
    echo "fuzz: $1: FAILED, $folder/$1.log:"
    tail -n 40 "$folder/$1.log"
    return 1
  fi
}
export -f run
export folder seed seconds

if $keep; then
  found=$(mktemp -d)
  trap 'rm -rf "$found"' EXIT
  for name in "${names[@]}"; do
    mkdir -p "tests/fuzz/corpus/$name" "$found/$name"
    find build/fuzz/corpus/"$name" -type f -size -3 -exec grep -LaF -e "$PWD" -e /dev/shm -e "$(hostname)" {} + |
      xargs -r -I {} cp {} "$found/$name" || true
    "$folder/bin/etalon_fuzz" --target="$name" -merge=1 -use_counters=0 "tests/fuzz/corpus/$name" "$found/$name" >"$folder/$name.log" 2>&1 || {
      echo "fuzz: $name: FAILED, $folder/$name.log:" >&2
      tail -n 40 "$folder/$name.log" >&2
      exit 1
    }
    echo "fuzz: $name: $(find "tests/fuzz/corpus/$name" -type f | wc -l) inputs kept"
  done
  exit 0
fi
echo "fuzz: $seconds s each: ${names[*]}"
printf '%s\n' "${names[@]}" | xargs -P "$jobs" -I {} bash -c 'run "$1"' _ {}
echo "fuzz: clean"
