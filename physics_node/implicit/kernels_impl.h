// All kernels of one instruction set as a table. FULCRUM_KERNEL_NAMESPACE names it. The equations, symbols and layouts
// stand at the head of the file of each group:
//
//   sheet_rows_impl.h      membrane: edges linearised, K p, p . K p             (stencil of three edges per node)
//   sheet_kernels_impl.h   membrane: prediction, energy, update; vector operations on fields
//   level_kernels_impl.h   membrane: diagonal blocks and hats; blocks of the coarse factor
//   organ_patches_impl.h   organ by patch: law, V P and V dP, energy            (gather over the vertices of a patch)
//   organ_kernels_impl.h   organ by vertex: residual, K p, diagonal blocks      (gather over the patches of a vertex)
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
  k.sheet.predict = SheetPredict;
  k.sheet.linearise = SheetLineariseRows;
  k.sheet.apply = SheetApply;
  k.sheet.curvature = SheetCurvature;
  k.sheet.energy = SheetEnergy;
  k.sheet.hat_blocks = HatBlocks;
  k.sheet.restrict_rows = SheetRestrict;
  k.sheet.precondition = SheetPrecondition;
  k.sheet.block_solve = SheetBlockSolve;
  k.sheet.finish = SheetFinish;
  k.sheet.step = SheetStep;
  k.sheet.largest = SheetLargest;
  k.organ.predict = OrganPredict;
  k.organ.linearise = OrganLinearise;
  k.organ.residual = OrganResidual;
  k.organ.blocks = OrganBlocks;
  k.organ.stress = OrganStress;
  k.organ.apply = OrganApply;
  k.organ.curvature = OrganCurvature;
  k.organ.block_solve = OrganBlockSolve;
  k.organ.energy = OrganEnergy;
  k.organ.finish = OrganFinish;
  k.organ.step = OrganStep;
  k.organ.largest = OrganLargest;
  k.field.combine = Combine;
  k.field.start = StartFields;
  k.field.advance = AdvanceFields;
  k.field.add = AddFields;
  k.field.within = Within;
  k.factor.block_product = BlockProduct;
  k.factor.substitute = Substitute;
  return k;
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
