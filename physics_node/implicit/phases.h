// Loops of a phase: tasks shared by the threads, and what belongs to a task of a field and of the regions. A phase ends
// when all of its tasks are done; no task writes what another task of its phase reads.
#pragma once

#include <algorithm>
#include <span>

#include "physics_node/implicit/field_layout.h"
#include "physics_node/implicit/regions.h"
#include "physics_node/implicit/workers.h"

namespace fulcrum::physics::implicit {

[[nodiscard]] inline std::uint32_t Vertex(int v) { return static_cast<std::uint32_t>(v); }

/// body(task, index, worker) for the tasks of a set of regions.
template <class Body>
void ForTasks(Workers* workers, const RegionSet& set, const Body& body) {
  workers->AlternateOrder();
  workers->Run(static_cast<int>(set.tasks.size()), set.sheet_tasks,
               [&](int index, int worker) { body(set.tasks[static_cast<std::size_t>(index)], index, worker); });
}

/// The same, and side_task() once, on the first thread that is free for it.
template <class Body, class SideTask>
void ForTasksAndSideTask(Workers* workers, const RegionSet& set, const Body& body, const SideTask& side_task) {
  const int count = static_cast<int>(set.tasks.size());
  workers->AlternateOrder();
  workers->Run(count + 1, set.sheet_tasks, 1, [&](int index, int worker) {
    if (index == count) {
      side_task();
    } else {
      body(set.tasks[static_cast<std::size_t>(index)], index, worker);
    }
  });
}

/// body(index, worker) for so many tasks of one kind and of another, beside two jobs of about the same length. The
/// first and the last thread get one of the jobs each, so all keep the tasks that they have in other phases.
template <class Body, class First, class Second>
void ForTasksBeside(Workers* workers, int kind0, int kind1, const Body& body, const First& first,
                    const Second& second) {
  workers->UseForwardOrder();
  workers->Run(kind0 + kind1 + 2, kind0 + 2, [&](int index, int worker) {
    if (index == 0) {
      first();
    } else if (index == kind0 + 1) {
      second();
    } else {
      body(index <= kind0 ? index - 1 : index - 2, worker);
    }
  });
}

/// body(first float, count) for the pieces of a field that belong to a task.
template <class Body>
void ForPieces(const FieldLayout& layout, const Task& task, const Body& body) {
  const auto first = static_cast<std::size_t>(task.first), length = static_cast<std::size_t>(task.end - task.first);
  if (!task.sheet) {
    body(kVertexFloats * first, kVertexFloats * length);
    return;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    body(layout.tube_floats + axis * layout.plane + layout.stride * first, layout.stride * length);
  }
}

/// body(region, first, end) for the rows or vertices of each region of a task.
template <class Body>
void ForRegions(const Partition& partition, const Task& task, const Body& body) {
  for (int first = task.first; first < task.end;) {
    const int region = partition.At(task.sheet, first), end = std::min(partition.Extent(region).end, task.end);
    body(region, first, end);
    first = end;
  }
}

/// The sum of the first `tasks` values, in the order of the tasks: it does not depend on the threads.
[[nodiscard]] inline double SumInOrder(std::span<const double> by_task, std::size_t tasks) {
  double sum = 0;
  for (const double value : by_task.first(tasks)) {
    sum += value;
  }
  return sum;
}

}  // namespace fulcrum::physics::implicit
