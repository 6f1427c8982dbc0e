#include "tests/system/chaos/small_room.h"

#include <fcntl.h>
#include <unistd.h>

#include <vector>

namespace fulcrum::testing {
namespace {

constexpr const char* kUnshare = "/usr/bin/unshare";

Program Start(const std::filesystem::path& place, const std::string& options, const std::string& command) {
  const std::string mount = "mount -t tmpfs -o " + options + " none " + place.string();
  return {kUnshare, {"-rm", "sh", "-c", mount + " && exec " + command}};
}

}  // namespace

bool CanMakeRoom() { return Start("/dev/shm", "size=1m", "true").End(0) == 0; }

SmallRoom::SmallRoom(const std::filesystem::path& place, const std::string& options, const std::string& scene,
                     int domain, const std::filesystem::path& out)
    : place_(place),
      out_(out),
      up_(Start(place, options,
                std::string(FULCRUM_BIN_DIR) + "/fulcrum up " + scene + " --domain " + std::to_string(domain) +
                    " --out " + out.string())) {}

std::filesystem::path SmallRoom::Inside(const std::filesystem::path& path) const {
  return "/proc/" + std::to_string(up_.pid()) + "/root" + path.string();
}

std::uint64_t SmallRoom::Fill() const {
  const int fd = ::open((Inside(place_) / "filler").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  if (fd < 0) return 0;
  const std::vector<char> zeros(1 << 16);
  std::uint64_t bytes = 0;
  for (ssize_t n = 0; (n = ::write(fd, zeros.data(), zeros.size())) > 0;) bytes += static_cast<std::uint64_t>(n);
  ::close(fd);
  return bytes;
}

}  // namespace fulcrum::testing
