// All kernels of one instruction set as a table. FULCRUM_KERNEL_NAMESPACE names it.
#pragma once

#include "physics_node/implicit/level_kernels_impl.h"
#include "physics_node/implicit/organ_kernels_impl.h"
#include "physics_node/implicit/organ_patches_impl.h"
#include "physics_node/implicit/sheet_kernels_impl.h"
#include "physics_node/implicit/sheet_rows_impl.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

constexpr implicit::Kernels MakeKernels(const char* name) {
  implicit::Kernels k{};
  k.name = name;
  k.sheet_guess = SheetGuess;
  k.sheet_linearise = SheetLineariseRows;
  k.sheet_apply = SheetApply;
  k.sheet_curvature = SheetCurvature;
  k.sheet_energy = SheetEnergy;
  k.middle_blocks = MiddleBlocks;
  k.sheet_restrict = SheetRestrict;
  k.sheet_precondition = SheetPrecondition;
  k.sheet_block_solve = SheetBlockSolve;
  k.sheet_finish = SheetFinish;
  k.sheet_step = SheetStep;
  k.sheet_largest = SheetLargest;
  k.block_product = BlockProduct;
  k.substitute = Substitute;
  k.combine = Combine;
  k.start = StartFields;
  k.advance = AdvanceFields;
  k.add = AddFields;
  k.within = Within;
  k.organ_guess = OrganGuess;
  k.organ_linearise = OrganLinearise;
  k.organ_residual = OrganResidual;
  k.organ_blocks = OrganBlocks;
  k.organ_stress = OrganStress;
  k.organ_apply = OrganApply;
  k.organ_curvature = OrganCurvature;
  k.organ_block_solve = OrganBlockSolve;
  k.organ_energy = OrganEnergy;
  k.organ_finish = OrganFinish;
  k.organ_step = OrganStep;
  k.organ_largest = OrganLargest;
  return k;
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
