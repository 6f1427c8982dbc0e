#include "services/session/supervisor/session_status.h"

#include <algorithm>
#include <string>

#include "services/session/supervisor/outcome.h"
#include "services/session/supervisor/script_outlook.h"

namespace fulcrum::supervisor {

void SessionStatus::Show(std::int64_t now_ns, const std::string& line) {
  line_ = line;
  progress_.Show(now_ns, line);
}

std::string FiguresLine(const std::string& phase, const SessionRecord& record, double session_time_s, double end_s) {
  const auto last = [&](const char* metric) { return record.last(metric); };
  std::string line = "t " + Fixed(std::max(0.0, session_time_s), 1);
  line += (end_s > 0 ? " / " + Fixed(end_s, 1) : std::string()) + " s";
  line += phase.empty() ? "" : " · " + phase;
  double force_N = 0;
  for (int i = 0; i < kMaxTools; ++i) force_N = std::max(force_N, record.last("force" + std::to_string(i) + "_N"));
  line += " · force " + Fixed(force_N, 2) + " N · displaced " + Fixed(last("displacement_mm"), 1) + " mm";
  // 0: thermal_node has not reported, as in a scene without a sheet.
  if (const double celsius = last("temperature_C"); celsius > 0) {
    line += " · " + Fixed(celsius, 0) + " °C · cut " + Fixed(last("cut_length_mm"), 1) + " mm";
  }
  return line;
}

}  // namespace fulcrum::supervisor
