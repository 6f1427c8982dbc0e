// Time and error of the thermal solver and its node; pictures are written to the folder of the figures.
#include <cstdlib>
#include <filesystem>

#include "services/base/runtime/realtime.h"
#include "tests/benchmark/thermal/paper_cases.h"
#include "tests/benchmark/thermal/picture.h"
#include "tests/benchmark/thermal/thermal_cases.h"
#include "tests/benchmark/thermal/volume_case.h"
#include "tests/benchmark/thermal/work_precision.h"

namespace fulcrum::thermal {

void Picture(const ThermalSolver& solver, const SceneView& scene, const Vec2f& centre, const std::string& name) {
  const char* given = std::getenv("FULCRUM_BENCH_OUT");
  const std::filesystem::path folder(given != nullptr ? given : FULCRUM_SOURCE_DIR "/out");
  std::filesystem::create_directories(folder);
  WritePicture(solver, scene, centre, 0.012f, folder / ("thermal_" + name + ".png"));
}

}  // namespace fulcrum::thermal

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  fulcrum::runtime::FlushDenormals();
  fulcrum::thermal::NodeCases(&report);
  fulcrum::thermal::CutCases(&report);
  fulcrum::thermal::HeatCases(&report);
  fulcrum::thermal::PotentialCases(&report);
  fulcrum::thermal::SheetsCases(&report);
  fulcrum::thermal::PublishedCases(&report);
  fulcrum::thermal::BenchmarkVolume(&report);
  fulcrum::thermal::WorkPrecision(&report);
  fulcrum::thermal::PaperCases(&report);
  return 0;
}
