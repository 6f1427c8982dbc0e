// The cases of the handle's benchmark; each prints the keys that it is named for.
#pragma once

#include "handle_bridge/estimator/jaw_calibration.h"
#include "tests/benchmark/report.h"

namespace fulcrum::handle_bridge {

/// The paper's straight line, 2.37 … 2.54 V for 0 … 60 degrees.
[[nodiscard]] JawCalibration PaperCalibration();

/// static_rms_deg, motion_rms_deg, lag_ms, step_us_p50; for comparison the same of raw codes.
void MeasureEstimator(benchmark::Report* report);
/// Plots every estimator's error against its lag into $FULCRUM_BENCH_OUT/handle_estimators.svg, when that is set.
void PlotEstimators(benchmark::Report* report);
/// calibrated_rms_deg over a batch of potentiometers, calibrated as `handle_bridge calibrate` does.
void MeasureCalibration(benchmark::Report* report);
/// wrong_values_per_h.framed and .plain, for comparison those of naive parsing; lines lost.
void MeasureWrongValues(benchmark::Report* report);
/// recover_ms: a real node on a real pseudo-terminal is unplugged and plugged in again.
void MeasureRecovery(benchmark::Report* report);
/// tick_us of one handle: bytes to estimate.
void MeasureTick(benchmark::Report* report);

}  // namespace fulcrum::handle_bridge
