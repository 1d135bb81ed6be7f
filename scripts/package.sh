#!/usr/bin/env bash
# Builds the Debian package of Etalon: build/package/etalon_VERSION_ARCHITECTURE.deb.
#
#   scripts/package.sh [--try]
#
# --try: as root, installs it into a fresh Debian in a folder of its own (with the package sources of this machine), and there
# simulates a flight, replays it, and asks for a man page and the completion.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

try=false
for argument in "$@"; do
  case "$argument" in
    --try) try=true ;;
    *)
      echo "package.sh: unknown argument '$argument'; expected --try" >&2
      exit 2
      ;;
  esac
done

scripts/install_dependencies.sh --package
folder=build/package
echo "package: building in $folder"
cmake --preset release -B "$folder" -DCMAKE_INSTALL_PREFIX=/usr -DETALON_BUILD_TESTS=OFF >/dev/null
cmake --build "$folder" --target all man
(cd "$folder" && cpack -G DEB >cpack.log) || {
  cat "$folder/cpack.log" >&2
  exit 1
}
deb=$(ls -t "$folder"/etalon_*.deb | head -n 1)
echo "package: $deb, $(du -h "$deb" | cut -f 1)"
$try || exit 0

root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
echo "package: trying it in a fresh Debian"
mapfile -t sources < <(find /etc/apt/sources.list /etc/apt/sources.list.d -type f \( -name '*.list' -o -name '*.sources' \) -size +0 2>/dev/null)
suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
mmdebstrap --quiet --variant=apt --setup-hook='mkdir -p "$1/etc/apt" && cp -r /etc/apt/apt.conf.d "$1/etc/apt/"' \
  --include=man-db,bash-completion "$suite" "$root/debian" "${sources[@]}"
cp "$deb" "$root/debian/tmp/etalon.deb"
chroot "$root/debian" bash -euc '
  export DEBIAN_FRONTEND=noninteractive
  { apt-get update && apt-get install -y --no-install-recommends /tmp/etalon.deb; } >/tmp/install.log 2>&1 || { tail -n 20 /tmp/install.log; exit 1; }
  etalon --version
  etalon plugins
  etalon simulate --out /tmp/flight --duration 6 --seed 3
  etalon replay /tmp/flight -c /usr/share/etalon/config/euroc.ini --out /tmp/run
  man -P cat etalon-replay | head -n 4
  . /usr/share/bash-completion/completions/etalon
  COMP_WORDS=(etalon re) COMP_CWORD=1; _etalon; echo "completion of re: ${COMPREPLY[*]}"'
echo "package: works"
