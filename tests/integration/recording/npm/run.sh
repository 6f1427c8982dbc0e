#!/usr/bin/env bash
# run.sh FULCRUM RECORDING FOLDER: installs the readers of package-lock.json into FOLDER and runs check.mjs. Exit 77:
# they cannot be had here.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
fulcrum=$1 recording=$2 folder=$3

skip() {
  echo "SKIPPED: the recording was not read with the readers of others: $1"
  exit 77
}
command -v node >/dev/null || skip 'no node (apt-get install nodejs)'
command -v npm >/dev/null || skip 'no npm (apt-get install npm)'

mkdir -p "$folder"
if ! cmp -s "$here/package-lock.json" "$folder/package-lock.json" || [[ ! -e $folder/installed ]]; then
  rm -f "$folder/installed"
  cp "$here/package.json" "$here/package-lock.json" "$folder/"
  # The lock file holds a checksum of each package.
  (cd "$folder" && npm ci --ignore-scripts --no-audit --no-fund >npm.log 2>&1) ||
    skip "npm ci failed (no network?), see $folder/npm.log: $(grep -m 1 -i 'err' "$folder/npm.log" || true)"
  touch "$folder/installed"
fi
# Modules are looked for beside the script.
cp "$here/check.mjs" "$folder/"
node "$folder/check.mjs" "$fulcrum" "$recording"
