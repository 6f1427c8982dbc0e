#include "services/apps/replayer/film.h"

#include <charconv>
#include <cmath>
#include <istream>
#include <ostream>
#include <span>
#include <string>

#include "render_node/offscreen/jpeg.h"
#include "services/apps/replayer/projector.h"
#include "services/base/core/error.h"

namespace fulcrum::replay {
namespace {

double TimeIn(const std::string& line) {
  double time_s = 0;
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), time_s);
  if (error != std::errc() || end != line.data() + line.size() || !std::isfinite(time_s)) {
    throw InputError("film: \"" + line.substr(0, 40) + "\" is no session time in seconds, for example 12.5");
  }
  return time_s;
}

}  // namespace

void ShowFilm(const std::filesystem::path& recording, const SceneView& scene, std::istream& in, std::ostream& out) {
  Projector projector(recording, scene);
  out << "end " << projector.end_s() << '\n' << std::flush;
  render::Bitmap picture;
  render::JpegEncoder encoder;
  for (std::string line; std::getline(in, line);) {
    projector.GoTo(TimeIn(line));
    std::span<const std::uint8_t> jpeg;
    if (projector.Draw(&picture)) jpeg = encoder.Encode(picture, kMaxPictureBytes);
    out << line << ' ' << jpeg.size() << '\n';
    out.write(reinterpret_cast<const char*>(jpeg.data()), static_cast<std::streamsize>(jpeg.size()));
    out.flush();
    if (!out) return;
  }
}

}  // namespace fulcrum::replay
