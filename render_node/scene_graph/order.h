// In which order the scene is drawn, and what its shaders share.
#pragma once

#include <osg/StateSet>

namespace fulcrum::render {

/// Near to far among the opaque ones, so that hidden fragments are not shaded; then the layers that let light through,
/// from the inside out.
enum class Order { kBackground, kMask, kInstruments, kRectum, kSurroundings, kFat, kMembrane, kShadow, kSmoke };

/// Texture units; the samplers of all programs are bound once at the scene's root.
enum TextureUnit { kAtlasUnit, kNoiseUnit, kSerosaUnit, kStructureUnit };

inline void DrawIn(Order order, osg::StateSet* state) {
  state->setRenderBinDetails(static_cast<int>(order), "RenderBin");
}

/// What is drawn lets through what its alpha leaves.
void Blend(osg::StateSet* state);

}  // namespace fulcrum::render
