// Responses that are files.
#pragma once

#include <filesystem>
#include <string>

#include "services/session/console/http_message.h"

namespace fulcrum::console {

/// The file's bytes; 404 when it is missing or empty.
[[nodiscard]] HttpResponse FileResponse(const std::filesystem::path& file, const std::string& type);

}  // namespace fulcrum::console
