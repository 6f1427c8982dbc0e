# Set-up that deploy/run, deploy/test and deploy/bench share. Sourced, not run.
# After `fulcrum_set_up` the packages are there, build/release is configured and the targets given (all without one) are built.

fulcrum_root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
fulcrum_build=$fulcrum_root/build/release

fulcrum_fail() {
  printf '%s: %s\n' "${0##*/}" "$1" >&2
  exit "${2:-1}"
}

# fulcrum_packages [FILE]: installs what FILE (deploy/packages.txt) names and is not there.
fulcrum_packages() {
  local wanted missing
  mapfile -t wanted < <(sed -e 's/#.*//' -e 's/[[:space:]]//g' -e '/^$/d' "${1:-$fulcrum_root/deploy/packages.txt}")
  # Node.js from elsewhere brings an npm of its own, which Debian's would conflict with.
  if command -v npm >/dev/null; then
    mapfile -t wanted < <(printf '%s\n' "${wanted[@]}" | grep -vx -e nodejs -e npm)
  fi
  # Names of virtual or unknown packages make dpkg-query fail; what it printed is still right.
  mapfile -t missing < <(comm -23 <(printf '%s\n' "${wanted[@]}" | sort -u) \
    <(dpkg-query -W -f '${db:Status-Status} ${Package}\n' "${wanted[@]}" 2>/dev/null | sed -n 's/^installed //p' | sort -u))
  ((${#missing[@]})) || return 0

  local as_root=()
  if ((EUID != 0)); then
    if ! command -v sudo >/dev/null; then
      fulcrum_fail "these Debian packages are missing and only root may install them (there is no sudo): ${missing[*]}
  as root: apt-get update && apt-get install --no-install-recommends ${missing[*]}" 2
    fi
    as_root=(sudo)
  fi
  printf 'installing %d Debian packages: %s\n' "${#missing[@]}" "${missing[*]}"
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq update ||
    fulcrum_fail 'apt-get update failed: is the network there, and may this user use sudo?'
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -y --no-install-recommends install "${missing[@]}" \
    >/dev/null || fulcrum_fail 'apt-get install failed'
}

# fulcrum_step WHAT LOG COMMAND...: runs a long step quietly. What it is shows when it takes longer than a second, its
# output only when it fails. On a terminal the last "[done/all]" of its output is shown while it runs.
fulcrum_step() {
  local what=$1 log=$2 job tenths=0 said=
  shift 2
  mkdir -p "$(dirname "$log")"
  "$@" >"$log" 2>&1 9>&- &
  job=$!
  # A shell without job control lets its background jobs ignore Ctrl-C: they are ended here.
  trap 'kill "$job" 2>/dev/null; exit 130' INT TERM
  while kill -0 "$job" 2>/dev/null; do
    if ((tenths++ >= 10)); then
      [[ -n $said ]] || printf '%s ...\n' "$what"
      said=1
      [[ ! -t 1 ]] || printf '\r%s ' "$(tail -n 1 "$log" | grep -o '^\[[0-9]*/[0-9]*\]')"
    fi
    sleep 0.1
  done
  [[ -z $said || ! -t 1 ]] || printf '\r\033[K'
  if ! wait "$job"; then
    tail -n 60 "$log" >&2
    fulcrum_fail "$what failed; all of its output: $log"
  fi
  trap - INT TERM
}

# fulcrum_set_up [TARGET ...]
fulcrum_set_up() {
  cd "$fulcrum_root" || exit 1
  [[ -r /etc/debian_version ]] || fulcrum_fail 'this needs Debian 12 (other systems: see services/README.md)' 2
  fulcrum_packages
  # Two builds at once would spoil each other's records of what is up to date.
  mkdir -p "$fulcrum_root/build"
  exec 9>"$fulcrum_root/build/release.lock"
  flock 9
  if [[ ! -e $fulcrum_build/build.ninja ]]; then
    fulcrum_step 'configuring' "$fulcrum_root/build/release.configure.log" cmake --preset release
  fi
  fulcrum_step 'building (the first time this takes some minutes)' "$fulcrum_root/build/release.build.log" \
    ninja -C "$fulcrum_build" "$@"
  exec 9>&-
}
