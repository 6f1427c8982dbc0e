#!/usr/bin/env bash
# Installs the libraries into a folder of its own, builds the examples against them, and runs these.
#   install_libraries_test.sh BUILD_DIR CMAKE
set -euo pipefail
build=$1 cmake=$2
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$cmake" --install "$build" --component development --prefix "$work/prefix" >"$work/log" || { cat "$work/log"; exit 1; }
"$cmake" -S "$here/examples" -B "$work/build" -DCMAKE_PREFIX_PATH="$work/prefix" >"$work/log" 2>&1 ||
  { cat "$work/log"; exit 1; }
"$cmake" --build "$work/build" --parallel "$(nproc)" >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }

cd "$work"
for example in tissue thermal servo recording; do
  printf '%s: ' "$example"
  "build/$example"
  if ldd "build/$example" | grep -E 'fastrtps|fastcdr|libosg|yaml-cpp'; then
    printf 'FAILED %s depends on the middleware, the scene graph or the configuration\n' "$example"
    exit 1
  fi
done

# A component that does not exist is refused with the list of those that do.
mkdir wrong
printf 'cmake_minimum_required(VERSION 3.25)\nproject(wrong CXX)\nfind_package(Fulcrum REQUIRED COMPONENTS tisue)\n' \
  >wrong/CMakeLists.txt
if "$cmake" -S wrong -B wrong/build -DCMAKE_PREFIX_PATH="$work/prefix" >"$work/log" 2>&1 ||
  ! grep -q 'no component tisue; it has scene, tissue' "$work/log"; then
  cat "$work/log"
  exit 1
fi
