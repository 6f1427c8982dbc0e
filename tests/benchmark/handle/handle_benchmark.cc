// Jaw angle: error against the true motion, calibration, wrong values behind a bad cable, return after a replug, cost
// of a sample.
#include "tests/benchmark/handle/cases.h"

int main(int argc, char** argv) {
  using namespace fulcrum::handle_bridge;
  fulcrum::benchmark::Report report(argc, argv);
  if (!report.Wants("handle.")) {
    return 0;
  }
  MeasureEstimator(&report);
  MeasureCalibration(&report);
  MeasureWrongValues(&report);
  MeasureRecovery(&report);
  MeasureTick(&report);
  PlotEstimators(&report);
  return 0;
}
