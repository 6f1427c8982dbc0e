#include "tests/fuzz/target.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <system_error>

namespace fulcrum::fuzz {

namespace fs = std::filesystem;

Bytes ReadFile(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::vector<Seed> FilesOf(const std::string& folder, const std::string& extension) {
  std::vector<Seed> seeds;
  for (const auto& entry : fs::directory_iterator(fs::path(FULCRUM_SOURCE_DIR) / folder)) {
    if (entry.path().extension() == extension) seeds.push_back({entry.path().filename(), ReadFile(entry.path())});
  }
  std::sort(seeds.begin(), seeds.end(), [](const Seed& a, const Seed& b) { return a.name < b.name; });
  return seeds;
}

MemoryFile::MemoryFile() : fd_(::memfd_create("fuzzed", MFD_CLOEXEC)) {
  if (fd_ < 0) throw std::system_error(errno, std::generic_category(), "memfd_create");
  path_ = "/proc/self/fd/" + std::to_string(fd_);
}
MemoryFile::~MemoryFile() { ::close(fd_); }

void MemoryFile::Write(Input content) {
  if (::ftruncate(fd_, static_cast<off_t>(content.size())) != 0 ||
      ::pwrite(fd_, content.data(), content.size(), 0) != static_cast<ssize_t>(content.size())) {
    throw std::system_error(errno, std::generic_category(), "memory file");
  }
}

ScratchFolder::ScratchFolder() {
  std::string name = fs::temp_directory_path() / "fulcrum-fuzz-XXXXXX";
  if (::mkdtemp(name.data()) == nullptr) throw std::system_error(errno, std::generic_category(), name);
  path_ = name;
}
ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

void WriteFile(const fs::path& file, Input content) {
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(content.data()), static_cast<std::streamsize>(content.size()));
  if (!out.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

}  // namespace fulcrum::fuzz
