// What a tissue's parameters become, and which of them are refused.
#include "thermal_node/heat/material.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "services/base/core/error.h"
#include "services/base/core/thermal_bounds.h"

namespace fulcrum::thermal {
namespace {

TEST(MaterialTest, RefusesBadParametersWithNameValueAndRange) {
  ThermalParams params;
  params.thickness_m = 0.3f;  // millimetres given as metres
  try {
    (void)MakeMaterial(params);
    FAIL();
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("thermal.thickness_mm is 300; valid: 0.01 to 5"), std::string::npos) << text;
  }
  params = {};
  params.sigma_S_m = NAN;
  EXPECT_THROW((void)MakeMaterial(params), InputError);
  EXPECT_NO_THROW((void)MakeMaterial(ThermalParams{}));
}

TEST(MaterialTest, TakesWhatTheReaderOfScenesTakes) {
  for (const ThermalBound& bound : kThermalBounds) {
    for (const double valid : {bound.low, bound.high}) {
      ThermalParams params;
      params.*bound.value = static_cast<float>(valid * bound.si);  // As StrictMap converts it.
      EXPECT_NO_THROW((void)MakeMaterial(params)) << bound.key << ": " << valid;
    }
    ThermalParams params;
    params.*bound.value = static_cast<float>(1.001 * bound.high * bound.si);
    EXPECT_THROW((void)MakeMaterial(params), InputError) << bound.key;
  }
}

TEST(MaterialTest, HeatCapacityAndConductivitiesFallAsTheTissueDries) {
  const Material m = MakeMaterial(ThermalParams{});
  EXPECT_GT(m.HeatCapacity(0), 0.0f);
  EXPECT_LT(m.HeatCapacity(0), 0.3f * m.HeatCapacity(1));
  EXPECT_LT(m.ThermalConductivity(0), m.ThermalConductivity(1));
  EXPECT_FLOAT_EQ(m.ElectricalConductivity(0, 1), m.sigma);
  EXPECT_NEAR(m.ElectricalConductivity(60, 1) / m.sigma, 1.9f, 0.01f);
  EXPECT_NEAR(m.ElectricalConductivity(300, 0) / m.ElectricalConductivity(300, 1), 0.01f, 1e-4f);
}

}  // namespace
}  // namespace fulcrum::thermal
