// Drawing order of the scene, and texture units that its shaders share.
#pragma once

#include <osg/StateSet>

namespace fulcrum::render {

/// Opaque parts first, near to far, so that hidden fragments are not shaded; then translucent layers, from the inside
/// out.
enum class Order {
  kBackground,
  kMask,
  kInstruments,
  kRectum,
  kSurroundings,
  kBurn,
  kFat,
  kMembrane,
  kCut,
  kShadow,
  kSmoke
};

/// Texture units; the samplers of all programs are bound once at the scene's root, but for the burns of solids and
/// vessels that clips have cut off, which most sessions do not have. Units 6, 7 and 9 are those of optics.cc and
/// overlay.cc.
enum TextureUnit {
  kAtlasUnit,
  kNoiseUnit,
  kSerosaUnit,
  kStructureUnit,
  kBurnUnit,
  kFilmUnit,
  kFatUnit = 8,
  kCutOffUnit = 10
};

inline void DrawIn(Order order, osg::StateSet* state) {
  state->setRenderBinDetails(static_cast<int>(order), "RenderBin");
}

/// Enables alpha blending.
void Blend(osg::StateSet* state);

}  // namespace fulcrum::render
