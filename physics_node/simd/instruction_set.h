// The kernels are compiled from one source for three instruction sets (kernels.cc.in); one set is chosen at run time.
// All give the same bits: each operation on a lane is an IEEE add, multiply, divide or square root, in one order.
// AVX-512 processes two batches of a colour at a time; the operations on a lane stay the same.
//
// A folder's kernels.h declares its functions as a table, kernels_impl.h defines them. Neither includes a header with
// inline functions outside of the kernels' namespace: the linker could keep the copy compiled for AVX2 for the whole
// program.
#pragma once

#include <cstddef>
#include <cstdint>

namespace fulcrum::physics {

enum class InstructionSet { kBaseline, kAvx2, kAvx512 };
inline constexpr InstructionSet kInstructionSets[] = {InstructionSet::kBaseline, InstructionSet::kAvx2,
                                                      InstructionSet::kAvx512};

/// False: this CPU lacks the set; its kernels must not be called.
[[nodiscard]] bool Has(InstructionSet set);
/// The widest set that this CPU has.
[[nodiscard]] InstructionSet BestInstructionSet();

/// Constraints in a batch, and lanes of a row of the membrane: floats in an AVX register.
inline constexpr int kLanes = 8;
/// Each colour is filled up to a multiple of this number of batches, so that batches 2 i and 2 i + 1 share a colour and
/// an AVX-512 register can hold both.
inline constexpr std::size_t kBatchesAtOnce = 2;

}  // namespace fulcrum::physics
