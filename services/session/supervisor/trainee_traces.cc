#include "services/session/supervisor/trainee_traces.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <utility>

#include "services/base/core/error.h"
#include "services/base/core/escape.h"
#include "services/base/core/json_text.h"
#include "services/base/runtime/private_file.h"

namespace fulcrum::supervisor {
namespace {

namespace fs = std::filesystem;

/// Text that names the trainee, with what ends it, and what remains of it without the name.
std::pair<std::string, std::string> NamingText(const fs::path& file, const std::string& trainee) {
  if (file.extension() == ".json") return {",\n  \"trainee\": " + JsonString(trainee) + ",", ","};
  return {"<h2>Score sheet of " + EscapeHtml(trainee) + "</h2>", "<h2>Score sheet</h2>"};
}

std::string Content(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace

std::vector<fs::path> FindTraces(const fs::path& out, const std::string& trainee) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(out, error)) {
    if (entry.is_symlink(error) || !entry.is_directory(error)) continue;
    for (const char* name : {"assessment.json", "report.html"}) {
      const fs::path file = entry.path() / name;
      if (!fs::is_regular_file(file, error)) continue;
      if (Content(file).find(NamingText(file, trainee).first) != std::string::npos) files.push_back(file);
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

void RemoveName(const fs::path& file, const std::string& trainee) {
  const auto [naming, rest] = NamingText(file, trainee);
  std::string text = Content(file);
  for (std::size_t at = text.find(naming); at != std::string::npos; at = text.find(naming, at + rest.size())) {
    text.replace(at, naming.size(), rest);
  }
  runtime::WritePrivateFile(file, text, "the trainee's name could not be removed from");
}

}  // namespace fulcrum::supervisor
