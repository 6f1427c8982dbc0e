#define FULCRUM_KERNEL_NAMESPACE accurate_baseline
#include "physics_node/accurate/organ_kernels_impl.h"
#include "physics_node/accurate/sheet_kernels_impl.h"

namespace fulcrum::physics::accurate {

const Kernels& BaselineKernels() {
  namespace isa = accurate_baseline;
  static constexpr Kernels kernels{
      "baseline",         isa::SheetGuess,    isa::SheetLineariseRows, isa::SheetApply,     isa::SheetEnergy,
      isa::MiddleBlocks,  isa::SheetRestrict, isa::SheetPrecondition,  isa::Combine,        isa::StartFields,
      isa::AdvanceFields, isa::Largest,       isa::FinishSheet,        isa::OrganLinearise, isa::OrganBlocks,
      isa::OrganStress,   isa::OrganGather,   isa::OrganEnergy};
  return kernels;
}

}  // namespace fulcrum::physics::accurate
