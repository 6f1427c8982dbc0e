#!/usr/bin/env bash
# The deploy scripts in a copy of the tree that has stand-ins for packages, builds and programs: what they delete, how
# they pass on paths, and that nothing run is no success. Usage: scripts_test.sh SOURCE_FOLDER
set -uo pipefail
source=$1
root=$(realpath "$(mktemp -d)")
trap 'rm -rf "$root"' EXIT
tree=$root/tree
mkdir -p "$tree/deploy/docs" "$tree/build/release/bin" "$tree/build/fuzz/bin" "$root/tools" "$root/caller"
cp "$source"/deploy/{run,test,fuzz} "$tree/deploy/"
cp "$source/deploy/docs/build" "$tree/deploy/docs/"
cat >"$tree/deploy/lib.sh" <<TEXT
fulcrum_root=$tree
fulcrum_build=$tree/build/release
fulcrum_fail() { echo "\$1" >&2; exit "\${2:-1}"; }
fulcrum_packages() { :; }
fulcrum_step() { :; }
# Fails where the documentation would be built next.
fulcrum_set_up() { cd "\$fulcrum_root"; [[ \${0##*/} != build ]] || exit 7; }
TEXT
failed=0
expect() { # expect WHAT WANTED GOT
  [[ $2 == "$3" ]] || { printf 'FAILED: %s\n  wanted: %s\n  got:    %s\n' "$1" "$2" "$3"; failed=1; }
}
status() { "$@" >"$root/output" 2>&1; echo $?; }

docs=$tree/deploy/docs/build
mkdir "$root/full" "$root/empty" "$root/earlier"
touch "$root/full/thesis" "$root/earlier/.fulcrum-docs" "$root/earlier/index.html" "$root/file"
expect 'docs: a folder with other files is refused' 2 "$(status "$docs" --out "$root/full")"
expect 'docs: and kept' thesis "$(ls "$root/full")"
expect 'docs: a file is refused' 2 "$(status "$docs" --out "$root/file")"
for good in "$root/empty" "$root/new" "$root/earlier" "$tree/build/docs"; do
  expect "docs: $good is taken" 7 "$(status "$docs" --out "$good")"
done
mkdir "$tree/build/docs"
touch "$tree/build/docs/index.html"
expect 'docs: the default folder is taken without a mark' 7 "$(status "$docs" --out "$tree/build/docs")"

echo 'add_test(works true)' >"$tree/build/release/CTestTestfile.cmake"
expect 'test: a test that passes' 0 "$(status "$tree/deploy/test" -R works)"
expect 'test: a list of tests' 0 "$(status "$tree/deploy/test" -N)"
[[ $(status "$tree/deploy/test" -R nothing) != 0 ]] || expect 'test: no test is no success' 'a failure' 'success'

printf '#!/bin/sh\nprintf "fuzz_%%s: phony\\n" good absent broken\n' >"$root/tools/ninja"
printf '#!/bin/sh\n[ "$1" = --seeds ] || printf "Done 5 runs\\nstat::number_of_executed_units: 5\\nfuzz: inputs 5 accepted 5\\n"\n' >"$tree/build/fuzz/bin/fuzz_good"
printf '#!/bin/sh\nexit 1\n' >"$tree/build/fuzz/bin/fuzz_broken"
chmod +x "$root/tools/ninja" "$tree"/build/fuzz/bin/*
touch "$tree/build/fuzz/build.ninja"
expect 'fuzz: a target that runs' 0 "$(PATH=$root/tools:$PATH status "$tree/deploy/fuzz" --target good --runs 5)"
expect 'fuzz: targets that do not run have failed' 1 "$(PATH=$root/tools:$PATH status "$tree/deploy/fuzz" --runs 5)"
expect 'fuzz: and are named' 'failed: absent broken; see the ends of out/fuzz/NAME.log and out/fuzz/crashes' "$(tail -n 1 "$root/output")"

printf '#!/bin/sh\necho "$@"\n' >"$tree/build/release/bin/fulcrum"
chmod +x "$tree/build/release/bin/fulcrum"
paths=$(cd "$root/caller" && "$tree/deploy/run" --database d --database=d --keys k --keys=k --cart c --data=m --record-to r --out o)
expect 'run: paths are those of the caller' \
  "up built-in --out $root/caller/o --record --database $root/caller/d --database $root/caller/d --keys $root/caller/k \
--keys $root/caller/k --cart $root/caller/c --data $root/caller/m --record-to $root/caller/r" "$paths"

((failed == 0)) && echo 'all as it should be'
exit "$failed"
