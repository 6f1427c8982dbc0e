// The kernels are compiled from one source for three instruction sets (kernels.cc.in), and one is chosen at run time.
// All give the same bits: every operation on a lane is an IEEE add, multiply, divide or square root, in one order.
// AVX-512 takes two batches of a colour at a time, which changes no lane.
//
// A folder's kernels.h declares its functions as a table, kernels_impl.h defines them. Neither includes a header with
// inline functions of its own: such a function, compiled for AVX2, could be the copy that the linker keeps for the
// whole program.
#pragma once

#include <cstddef>
#include <cstdint>

namespace fulcrum::physics {

enum class InstructionSet { kBaseline, kAvx2, kAvx512 };
inline constexpr InstructionSet kInstructionSets[] = {InstructionSet::kBaseline, InstructionSet::kAvx2,
                                                      InstructionSet::kAvx512};

/// False: this CPU does not have it, and kernels of that set must not be called here.
[[nodiscard]] bool Has(InstructionSet set);
/// The widest that this CPU has.
[[nodiscard]] InstructionSet BestInstructionSet();

/// Constraints of one batch; also the lanes of a membrane row.
inline constexpr int kLanes = 8;
/// Batches 2 i and 2 i + 1 are of one colour: each colour is filled up to a multiple of so many batches.
inline constexpr std::size_t kBatchesAtOnce = 2;

}  // namespace fulcrum::physics
