#!/usr/bin/env bash
# run.sh FULCRUM FOLDER MODE [ARGUMENT...]: installs what drives the browser (package-lock.json) into FOLDER and runs
# MODE.mjs, for example check. Exit 77: browser or driver cannot be had here.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
fulcrum=$1 folder=$2 mode=$3

skip() {
  echo "SKIPPED: the page was not opened in a browser: $1"
  exit 77
}
browser=$(command -v chromium || command -v chromium-browser || true)
[[ -n $browser ]] || skip 'no chromium (apt-get install --no-install-recommends chromium; 25 s)'
command -v node >/dev/null || skip 'no node (apt-get install nodejs)'
command -v npm >/dev/null || skip 'no npm (apt-get install npm)'

mkdir -p "$folder"
if ! cmp -s "$here/package-lock.json" "$folder/package-lock.json" || [[ ! -e $folder/installed ]]; then
  rm -f "$folder/installed"
  cp "$here/package.json" "$here/package-lock.json" "$folder/"
  # The lock file holds a checksum of the package. Its own browsers are not fetched.
  (cd "$folder" && npm ci --ignore-scripts --no-audit --no-fund --fetch-retries=1 --fetch-timeout=20000 >npm.log 2>&1) ||
    skip "npm ci failed (no network?), see $folder/npm.log: $(grep -m 1 -i 'err' "$folder/npm.log" || true)"
  touch "$folder/installed"
fi
# Modules are looked for beside the script.
cp "$here"/*.mjs "$folder/"
exec node "$folder/$mode.mjs" "$fulcrum" "$browser" "$folder" "${@:4}"
