#!/usr/bin/env bash
# A solver archive must know nothing of the middleware, the scene graph, the configuration or the network.
#   check_symbols.sh BUILD_DIR
# Every static library below a node's folder is a solver, and so is the assessment; except the node's own library
# lib<project>_<node>.a, and the view, which is made of the scene graph.
set -euo pipefail
build=$1
forbidden='eprosima|fastrtps|fastdds|fastcdr|osg::|YAML::|fulcrum::idl::|fulcrum::app::|boost::'
nodes=(physics_node thermal_node haptics_node handle_bridge render_node services/session/assessment)
checked=0
failed=0
for node in "${nodes[@]}"; do
  while IFS= read -r archive; do
    name=$(basename "$archive" .a)
    case "$name" in
      libfulcrum_recorded_assessment | libfulcrum_render_view | libfulcrum_"$node" | libfulcrum_handle_bridge_serial | libfulcrum_render_node_*) continue ;;
    esac
    checked=$((checked + 1))
    # Not `| head`: with pipefail a grep that is cut short would count as one that found nothing.
    hits=$(nm -C "$archive" 2>/dev/null | grep -E "$forbidden") || true
    if [ -n "$hits" ]; then
      hits=$(head -n 5 <<<"$hits")
      printf 'FAILED %s reaches beyond core:\n%s\n' "$name" "$hits"
      failed=1
    else
      printf 'ok     %s\n' "$name"
    fi
  done < <(find "$build/$node" -name 'lib*.a' | sort)
done
# Guards the guard: the solvers of physics, thermal, haptics and handle must have been there to be read.
if [ "$checked" -lt 6 ]; then
  printf 'FAILED only %d solver archives found below %s: build everything first\n' "$checked" "$build"
  exit 1
fi
exit "$failed"
