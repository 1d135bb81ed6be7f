#!/usr/bin/env bash
# Installs what is missing to build Etalon on Debian 12, with apt: as root, or through sudo; and the charting library of
# the HTML report, with npm.
#
#   scripts/install_dependencies.sh [--test] [--lint] [--benchmarks] [--package] [--fuzz]
#
# Without arguments: what building takes, the unit tests included. --test adds what the tests call
# (rawlog-edit, GNU parallel, Chromium, Python, a virtual X server), --lint the formatter, the linter and Doxygen, --benchmarks Google Benchmark, --package
# what makes and tries the Debian package, --fuzz clang with libFuzzer.
# Exit code 1 if something is missing and cannot be installed; the command to do it is printed.
set -euo pipefail

# libopencv-dev and not its parts: only it holds OpenCV's CMake configuration.
packages=(
  cmake ninja-build ccache g++ git
  libmrpt-obs-dev libmrpt-gui-dev librosbag-storage-dev libsensor-msgs-dev libfastcdr-dev libsqlite3-dev libceres-dev libeigen3-dev libopencv-dev libyaml-cpp-dev libboost-dev
  nlohmann-json3-dev libexpected-dev libcli11-dev libxxhash-dev pkg-config libgtest-dev libgmock-dev
)
report_folder="$(dirname "${BASH_SOURCE[0]}")/../modules/report/page"
npm_omit=(--omit=dev)
for argument in "$@"; do
  case "$argument" in
    --test)
      packages+=(mrpt-apps parallel chromium python3 xvfb libgl1-mesa-dri)
      npm_omit=()
      ;;
    --lint) packages+=(clang-format-14 clang-tidy-14 doxygen) ;;
    --benchmarks) packages+=(libbenchmark-dev) ;;
    --fuzz) packages+=(clang-14 libclang-rt-14-dev) ;;
    --package) packages+=(dpkg-dev help2man mmdebstrap) ;;
    *)
      echo "install_dependencies.sh: unknown argument '$argument'; expected --test, --lint, --benchmarks, --package or --fuzz" >&2
      exit 2
      ;;
  esac
done

# Any npm will do; Debian's brings hundreds of packages along.
command -v npm >/dev/null || packages+=(npm)

# The report's front end, exactly as package-lock.json has it; nothing to do where it is there.
install_report_packages() {
  if npm ls --prefix "$report_folder" "${npm_omit[@]}" >/dev/null 2>&1; then
    echo "dependencies: the report's packages are installed"
    return
  fi
  echo "dependencies: installing the report's packages"
  npm ci --prefix "$report_folder" "${npm_omit[@]}" --no-audit --no-fund
}

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
  [[ $status == installed ]] || missing+=("$package")
done
if ((${#missing[@]} == 0)); then
  echo "dependencies: all ${#packages[@]} packages are installed"
  install_report_packages
  exit 0
fi

echo "dependencies: missing ${missing[*]}"
install=(apt-get install -y --no-install-recommends "${missing[@]}")
as_root=()
if ((EUID != 0)); then
  # sudo may ask for its password only where there is somebody to answer.
  if command -v sudo >/dev/null && { sudo -n true 2>/dev/null || [[ -t 0 ]]; }; then
    as_root=(sudo)
  else
    echo "dependencies: to install them, root rights are needed; run as root:" >&2
    echo "  apt-get update && ${install[*]}" >&2
    exit 1
  fi
fi
apt_environment=(env DEBIAN_FRONTEND=noninteractive)
"${as_root[@]}" "${apt_environment[@]}" apt-get update ||
  echo "dependencies: apt-get update failed; trying with the package lists at hand" >&2
"${as_root[@]}" "${apt_environment[@]}" "${install[@]}"
install_report_packages
