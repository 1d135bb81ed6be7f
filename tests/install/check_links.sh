#!/usr/bin/env bash
# Whether the relative links of all Markdown pages below a folder lead to something in it.
#   check_links.sh FOLDER
set -euo pipefail
folder=$(realpath "$1")
broken=0 links=0
while IFS= read -r page; do
  while IFS= read -r link; do
    target=${link%%#*}
    case $link in
      *://* | mailto:* | '#'*) continue ;;
    esac
    links=$((links + 1))
    found=$(realpath --canonicalize-existing "$(dirname "$page")/$target" 2> /dev/null || true)
    if [[ $found != "$folder"/* ]]; then
      echo "$page: the link '$link' leads nowhere in $folder"
      broken=1
    fi
  done < <(grep -o '\](\([^)]*\))' "$page" | sed 's/^](//; s/)$//')
done < <(find "$folder" -name '*.md')
echo "$links links"
[[ $links -gt 0 && $broken -eq 0 ]]
