// Reading the sections of a scene description that are plain parameters: physics, thermal, render, haptics, breathing,
// assessment.
#pragma once

#include <vector>

#include "services/base/config/strict_yaml.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::scene {

/// Reads one key per field; its default is the present value of the field.
void ReadSi(config::StrictMap* map, const char* key, const config::Range& range, float* field);
void ReadSi(config::StrictMap* map, const char* key, const config::Range& range, double* field);
void ReadInteger(config::StrictMap* map, const char* key, int min, int max, int* field);
void ReadInteger(config::StrictMap* map, const char* key, int min, int max, std::uint32_t* field);

/// Each function reads its section; keys that are absent keep the values of the last argument. Throws InputError.
void ReadPhysics(config::StrictMap map, PhysicsParams* p);
void ReadThermal(config::StrictMap map, ThermalParams* t);
void ReadRender(config::StrictMap map, RenderParams* r, StereoParams* s);
void ReadHaptics(config::StrictMap map, HapticsParams* h);
/// `mode`: of the physics section; in mode paper there is no breathing.
void ReadBreathing(config::StrictMap map, PhysicsMode mode, Breathing* b);

/// `line`: the planned line, fractions of the sheet.
void ReadAssessment(config::StrictMap map, AssessmentParams* a, std::vector<Vec2f>* line);

}  // namespace fulcrum::scene
