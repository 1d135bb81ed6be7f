#!/usr/bin/env bash
# clang-format 14 on all tracked C++ files, then clang-tidy 14 on the sources of modules, plugins and
# application (with their headers), as .clang-format and .clang-tidy say; Doxygen on the public headers and the documents,
# whose page is build/api/html/index.html: a docstring or a link that it cannot resolve is an error.
#
#   scripts/lint.sh [--all] [--since COMMIT]
#
#   --all            clang-tidy on the tests and benchmarks, too
#   --since COMMIT   clang-tidy only on the units of sources that changed since then, and on one unit for every header
#                    that did; on all where .clang-tidy changed or the clone does not reach back so far
#
# What passed is remembered in build/lint by the content of the sources, of the project's headers that
# they include, and of .clang-tidy: a second call checks only what changed. Exit code 1 if anything
# was found.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

all=false since=
while (($# > 0)); do
  case "$1" in
    --all) all=true ;;
    --since)
      since=${2:?lint.sh: --since needs a commit}
      shift
      ;;
    *)
      echo "lint.sh: unknown argument '$1'; expected --all or --since COMMIT" >&2
      exit 2
      ;;
  esac
  shift
done

mapfile -t tracked < <(git ls-files --cached --others --exclude-standard '*.cpp' '*.h')
echo "lint: clang-format on ${#tracked[@]} files"
formatted=true
if ! clang-format-14 --dry-run --Werror "${tracked[@]}"; then
  echo "lint: not formatted; run: clang-format-14 -i \$(git ls-files '*.cpp' '*.h')" >&2
  formatted=false
fi

echo "lint: doxygen"
documented=true
doxygen docs/Doxyfile || documented=false

folder=build/release
[[ -f $folder/compile_commands.json ]] || cmake --preset release >/dev/null
# Neither the test suite nor continuous integration compiles the benchmarks.
if $all; then cmake --preset release -DETALON_BUILD_BENCHMARKS=ON >/dev/null; fi
memory=build/lint
mkdir -p "$memory"
# clang-tidy reads no headers that GCC precompiled, and so notices an include that is missing.
sed 's/ -Winvalid-pch -include [^ ]*//' "$folder/compile_commands.json" >"$memory/compile_commands.json"

# Content of every file of the project, hashed once.
declare -A hash_of
while read -r hash file; do hash_of[$file]=$hash; done < <(sha256sum "${tracked[@]}" .clang-tidy)
everything=$(printf '%s\n' "${hash_of[@]}" | sort | sha256sum)
common="${hash_of[.clang-tidy]} $(clang-tidy-14 --version | tr -d '\n')"

# The project's headers behind each source, as the compiler reported them to Ninja: "source header header...".
declare -A headers_of
while read -r source headers; do headers_of[$source]=$headers; done < <(
  ninja -C "$folder" -t deps 2>/dev/null | awk -v root="$PWD/" '
    /^[^ ]/ { if (source != "") print source, headers; source = headers = ""; next }
    NF == 1 {
      path = $1
      sub(/^\.\.\/\.\.\//, "", path)
      if (index(path, root) == 1) path = substr(path, length(root) + 1)
      if (path ~ /^\//) next
      if (source == "") source = path; else headers = headers " " path
    }
    END { if (source != "") print source, headers }')

# What changed since that commit. A header is crossed off by the first unit that includes it.
declare -A changed
if [[ -n $since ]]; then
  if ! git rev-parse --quiet --verify "$since^{commit}" >/dev/null; then
    echo "lint: there is no commit $since here; clang-tidy looks at everything"
    since=
  elif ! git diff --quiet "$since" -- .clang-tidy; then
    echo "lint: .clang-tidy changed since $since; clang-tidy looks at everything"
    since=
  else
    while read -r file; do changed[$file]=1; done < <(
      git diff --name-only "$since" -- '*.cpp' '*.h'
      git ls-files --others --exclude-standard '*.cpp' '*.h'
    )
  fi
fi

# Whether a unit has something that changed: $2... its sources.
is_changed() {
  [[ -n $since ]] || return 0
  local unit=$1 found=1 file
  for file in "${@:2}"; do [[ -z ${changed[$file]:-} ]] || found=0; done
  for file in ${headers_of[$unit]:-}; do
    [[ $file == *.h && -n ${changed[$file]:-} ]] || continue
    unset "changed[$file]"
    found=0
  done
  return $found
}

# What the compiler is given: the sources of a target, eight at a time (CMake's unity build), or one by itself. What stands
# in none of them (a project of its own inside a test) has no flags to check it with.
todo=()
while read -r unit; do
  [[ $unit == "$PWD/"* ]] || continue
  unit=${unit#"$PWD/"}
  mapfile -t sources < <(sed -n "s|^#include \"$PWD/\(.*\.cpp\)\"$|\1|p" "$unit")
  ((${#sources[@]} > 0)) || sources=("$unit")
  if ! $all && printf '%s\n' "${sources[@]}" | grep -qE '(^|/)(tests|benchmarks)/'; then continue; fi
  is_changed "$unit" "${sources[@]}" || continue
  parts=$common
  for source in "${sources[@]}"; do parts+=" $source ${hash_of[$source]:-}"; done
  if [[ -n ${headers_of[$unit]+known} ]]; then
    for header in ${headers_of[$unit]}; do parts+=" ${hash_of[$header]:-}"; done
  else
    parts+=" $everything"
  fi
  key=$(sha256sum <<<"$parts")
  key=${key%% *}
  [[ -e $memory/$key ]] || todo+=("$unit" "$key")
done < <(sed -n 's/^ *"file": "\(.*\)",\{0,1\}$/\1/p' "$folder/compile_commands.json")

count=$((${#todo[@]} / 2))
echo "lint: clang-tidy on $count units that changed"
tidy=true
if ((count > 0)); then
  # shellcheck disable=SC2016 # expanded by the inner shell
  printf '%s\n' "${todo[@]}" | xargs -P "$(nproc)" -n 2 bash -c '
    if output=$(clang-tidy-14 -p "$0" --quiet "$1" 2>&1); then
      : >"$0/$2"
      echo "lint: ok      $1"
    else
      echo "$output" | grep -vE "^[0-9]+ warnings? " >&2
      echo "lint: FAILED  $1"
      exit 1
    fi' "$memory" || tidy=false
fi
if ! $formatted || ! $documented || ! $tidy; then
  $formatted || echo "lint: clang-format would change files, see above" >&2
  $documented || echo "lint: doxygen found something, see above" >&2
  $tidy || echo "lint: clang-tidy found something, see above" >&2
  exit 1
fi
echo "lint: clean"
