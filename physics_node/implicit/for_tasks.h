// Bodies of ImplicitSolver's loops over what is awake; for its own sources.
#pragma once

#include <algorithm>

#include "physics_node/implicit/implicit_solver.h"

namespace fulcrum::physics::implicit {

inline std::uint32_t Vertex(int v) { return static_cast<std::uint32_t>(v); }

template <class Body>
void ImplicitSolver::ForTasks(const Part& part, const Body& body) {
  workers_.Turn();
  workers_.Run(static_cast<int>(part.tasks.size()), part.sheet_tasks,
               [&](int index, int worker) { body(part.tasks[static_cast<std::size_t>(index)], index, worker); });
}

template <class Body, class Errand>
void ImplicitSolver::ForTasks(const Body& body, const Errand& errand) {
  const std::span<const Task> tasks = regions_.part().tasks;
  const int count = static_cast<int>(tasks.size());
  workers_.Turn();
  workers_.Run(count + 1, regions_.part().sheet_tasks, 1, [&](int index, int worker) {
    if (index == count) {
      errand();
    } else {
      body(tasks[static_cast<std::size_t>(index)], index, worker);
    }
  });
}

/// The first and the last thread have one of the jobs each, so all keep the tasks that they have in other phases.
template <class Body, class First, class Second>
void ImplicitSolver::ForTasksBeside(int kind0, int kind1, const Body& body, const First& first, const Second& second) {
  workers_.TurnForward();
  workers_.Run(kind0 + kind1 + 2, kind0 + 2, [&](int index, int worker) {
    if (index == 0) {
      first();
    } else if (index == kind0 + 1) {
      second();
    } else {
      body(index <= kind0 ? index - 1 : index - 2, worker);
    }
  });
}

template <class Body>
void ImplicitSolver::ForParts(const Task& task, const Body& body) const {
  if (!task.sheet) {
    body(4 * static_cast<std::size_t>(task.first), 4 * static_cast<std::size_t>(task.end - task.first));
    return;
  }
  const std::size_t stride = plane_ / static_cast<std::size_t>(rows_);
  const std::size_t first = stride * static_cast<std::size_t>(task.first),
                    count = stride * static_cast<std::size_t>(task.end - task.first);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    body(tube_floats_ + axis * plane_ + first, count);
  }
}

template <class Body>
void ImplicitSolver::ForRegions(const Task& task, const Body& body) const {
  const int size = task.sheet ? Regions::kRows : Regions::kVertices;
  for (int first = task.first; first < task.end; first += size) {
    body(regions_.At(task.sheet, first), first, std::min(first + size, task.end));
  }
}

/// In the order of the tasks, whoever did them.
inline double ImplicitSolver::SumOfPartials(std::size_t tasks) const {
  double sum = 0;
  for (std::size_t i = 0; i < tasks; ++i) {
    sum += partial_[i];
  }
  return sum;
}

}  // namespace fulcrum::physics::implicit
