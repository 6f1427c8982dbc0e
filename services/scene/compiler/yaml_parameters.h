// Reading the sections of a scene description that are plain parameters: physics, thermal, render, haptics, breathing,
// assessment.
#pragma once

#include <vector>

#include "services/base/config/strict_yaml.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::scene {

/// One key per field, default = the field's own.
void ReadSi(config::StrictMap* map, const char* key, const config::Range& range, float* field);
void ReadSi(config::StrictMap* map, const char* key, const config::Range& range, double* field);
void ReadInteger(config::StrictMap* map, const char* key, int min, int max, int* field);
void ReadInteger(config::StrictMap* map, const char* key, int min, int max, std::uint32_t* field);

/// Each reads its section over the defaults in the last argument. Throws InputError.
void ReadPhysics(config::StrictMap map, PhysicsParams* p);
void ReadThermal(config::StrictMap map, ThermalParams* t);
void ReadRender(config::StrictMap map, RenderParams* r);
void ReadHaptics(config::StrictMap map, HapticsParams* h);
/// `mode`: of the physics that was read; in mode paper nothing breathes.
void ReadBreathing(config::StrictMap map, PhysicsMode mode, Breathing* b);

/// `line`: the planned line, fractions of the sheet.
void ReadAssessment(config::StrictMap map, AssessmentParams* a, std::vector<Vec2f>* line);

}  // namespace fulcrum::scene
