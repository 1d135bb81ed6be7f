#!/usr/bin/env bash
# A copy of a EuRoC folder whose image stamps are shifted by MS milliseconds against IMU and ground truth (images by
# reference): what a time offset does to a method, and whether a recording has one.
#
#   scripts/shift_images.sh SRC DST MS
set -euo pipefail
[[ $# -eq 3 ]] || { sed -n '2,6p' "$0"; exit 2; }
source=$(cd "$1" && pwd) destination=$2 shift_ms=$3
[[ -d $source/mav0 ]] || { echo "shift_images.sh: no mav0/ in $source" >&2; exit 3; }
[[ ! -e $destination ]] || { echo "shift_images.sh: $destination exists" >&2; exit 2; }
for folder in "$source"/mav0/*/; do
  name=$(basename "$folder")
  mkdir -p "$destination/mav0/$name"
  for entry in "$folder"*; do ln -s "$entry" "$destination/mav0/$name/"; done
done
for camera in cam0 cam1; do
  csv=$destination/mav0/$camera/data.csv
  rm "$csv"
  while IFS=, read -r stamp file; do
    if [[ $stamp == \#* ]]; then echo "$stamp,$file"; else echo "$((stamp + shift_ms * 1000000)),$file"; fi
  done <"$source/mav0/$camera/data.csv" >"$csv"
done
