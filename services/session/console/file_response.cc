#include "services/session/console/file_response.h"

#include <algorithm>
#include <fstream>
#include <optional>
#include <utility>

#include "services/session/console/router.h"

namespace fulcrum::console {
namespace {

namespace fs = std::filesystem;

std::optional<std::string> ReadAll(const fs::path& file) {
  std::error_code error;
  const auto size = fs::is_regular_file(file, error) ? fs::file_size(file, error) : 0;
  if (error || size == 0) return {};
  // One read call for the whole file, because pictures are read many times a minute.
  std::string bytes(size, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, stream.gcount())));
  return bytes;
}

}  // namespace

HttpResponse FileResponse(const fs::path& file, const std::string& type) {
  std::optional<std::string> bytes = file.empty() ? std::nullopt : ReadAll(file);
  if (!bytes) return Refusal(404, "the file does not exist, or not yet");
  return {.type = type, .body = *std::move(bytes)};
}

}  // namespace fulcrum::console
