# Set-up that deploy/run, deploy/test and deploy/bench share. Sourced, not run.
# After `fulcrum_set_up` the packages are there, build/release is configured and the targets given (all without one) are built.

fulcrum_root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
fulcrum_build=$fulcrum_root/build/release

fulcrum_fail() {
  printf '%s: %s\n' "${0##*/}" "$1" >&2
  exit "${2:-1}"
}

# Installs what deploy/packages.txt names and is not there.
fulcrum_packages() {
  local wanted missing
  mapfile -t wanted < <(sed -e 's/#.*//' -e 's/[[:space:]]//g' -e '/^$/d' "$fulcrum_root/deploy/packages.txt")
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

# Runs a long step quietly: one line before, its output only when it fails.
fulcrum_step() {
  local what=$1 log=$2
  shift 2
  printf '%s ...\n' "$what"
  mkdir -p "$(dirname "$log")"
  if ! "$@" >"$log" 2>&1; then
    tail -n 60 "$log" >&2
    fulcrum_fail "$what failed; all of its output: $log"
  fi
}

# fulcrum_compile [TARGET ...]: builds these, or everything.
fulcrum_compile() {
  local log=$fulcrum_root/build/release.build.log plan
  # The list of test folders is looked through again each time; that is no work.
  plan=$(ninja -C "$fulcrum_build" -n "$@" 2>&1 | grep -v 'Re-checking globbed') || true
  [[ $plan == *'Building '* || $plan == *'Linking '* || $plan != *'no work to do'* ]] || return 0
  # On a terminal ninja shows one live line; into a pipe it would print thousands.
  if [[ -t 1 ]]; then
    printf 'building ...\n'
    ninja -C "$fulcrum_build" "$@" || fulcrum_fail 'the build failed'
  else
    fulcrum_step 'building (the first time this takes some minutes)' "$log" ninja -C "$fulcrum_build" "$@"
  fi
}

# fulcrum_set_up [TARGET ...]
fulcrum_set_up() {
  cd "$fulcrum_root" || exit 1
  [[ -r /etc/debian_version ]] || fulcrum_fail 'this needs Debian 12 (other systems: see services/README.md)' 2
  fulcrum_packages
  if [[ ! -e $fulcrum_build/build.ninja ]]; then
    fulcrum_step 'configuring' "$fulcrum_root/build/release.configure.log" cmake --preset release
  fi
  fulcrum_compile "$@"
}
