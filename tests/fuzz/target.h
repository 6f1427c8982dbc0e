// A fuzz target: takes any bytes as one kind of file or message and checks what must hold for all of them. The same
// class runs under libFuzzer (engine.cc) and in fuzz_targets_test, which offers it everything that it must accept.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace fulcrum::fuzz {

using Bytes = std::vector<std::uint8_t>;
using Input = std::span<const std::uint8_t>;

enum class Outcome { kRefused, kAccepted };

/// Thrown by the check of a target when a property that must hold for all inputs is violated.
class BrokenPromise : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};
inline void Promise(bool holds, const std::string& what) {
  if (!holds) throw BrokenPromise(what);
}

/// An input that its target must accept.
struct Seed {
  std::string name;
  Bytes bytes;
};

class Target {
 public:
  Target() = default;
  virtual ~Target() = default;
  Target(const Target&) = delete;
  Target& operator=(const Target&) = delete;

  /// Throws BrokenPromise. Any other exception is a bug of the parser, because its callers do not expect one.
  virtual Outcome Offer(Input input) = 0;
  /// A mutation of an input, for formats that byte changes mostly destroy; empty: none.
  [[nodiscard]] virtual Bytes Mutate(Input, unsigned /*seed*/) { return {}; }
  /// Words that occur often in inputs, of letters, digits and plain signs.
  [[nodiscard]] virtual std::vector<std::string> Words() { return {}; }
  /// The shipped files of this kind, and the output of this project's own writers.
  [[nodiscard]] virtual std::vector<Seed> Seeds() { return {}; }
};

[[nodiscard]] inline std::string_view TextOf(Input input) {
  return {reinterpret_cast<const char*>(input.data()), input.size()};
}
[[nodiscard]] inline Bytes BytesOf(std::string_view text) { return {text.begin(), text.end()}; }
[[nodiscard]] Bytes ReadFile(const std::filesystem::path& file);
/// The files in a folder of the source tree whose names end in `extension`, as seeds.
[[nodiscard]] std::vector<Seed> FilesOf(const std::string& folder, const std::string& extension);

/// A file in memory with a path, for parsers that take a path.
class MemoryFile {
 public:
  MemoryFile();
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  void Write(Input content);
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  int fd_;
  std::filesystem::path path_;
};

/// A folder in TMPDIR, removed at the end.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Replaces the content of a file.
void WriteFile(const std::filesystem::path& file, Input content);

/// Changes `good` according to `input`, a list of: place in four bytes (little endian, modulo the length), length in
/// one, bytes. A length of 255 cuts `good` off there. For formats that are too large to be mutated as a whole.
template <class Byte>
void Patch(Input input, std::vector<Byte>* good) {
  while (input.size() >= 5 && !good->empty()) {
    std::uint32_t place = 0;
    std::memcpy(&place, input.data(), 4);
    const std::size_t at = place % good->size();
    const bool cut = input[4] == 255;
    const std::size_t length = cut ? 0 : std::min<std::size_t>(input[4], input.size() - 5);
    if (cut) good->resize(at);
    for (std::size_t i = 0; i < length && at + i < good->size(); ++i) (*good)[at + i] = Byte{input[5 + i]};
    input = input.subspan(5 + length);
  }
}

// One function for each target that deploy/fuzz runs; tests/fuzz/*/CMakeLists.txt names them.
std::unique_ptr<Target> MakeCart();
std::unique_ptr<Target> MakeCourse();
std::unique_ptr<Target> MakeSceneYaml();
std::unique_ptr<Target> MakeCompiledScene();
std::unique_ptr<Target> MakeMeshMsh();
std::unique_ptr<Target> MakeMeshVtk();
std::unique_ptr<Target> MakeMeshVtu();
std::unique_ptr<Target> MakeMeshEle();
std::unique_ptr<Target> MakeMeshFace();
std::unique_ptr<Target> MakeMeshStl();
std::unique_ptr<Target> MakeMeshObj();
std::unique_ptr<Target> MakeMeshPly();
std::unique_ptr<Target> MakeDicom();
std::unique_ptr<Target> MakeRecording();
std::unique_ptr<Target> MakeCheckpointFile();
std::unique_ptr<Target> MakeCheckpointPhysics();
std::unique_ptr<Target> MakeCheckpointThermal();
std::unique_ptr<Target> MakeKeys();
std::unique_ptr<Target> MakeTrainee();
std::unique_ptr<Target> MakeLink();
std::unique_ptr<Target> MakeControl();
std::unique_ptr<Target> MakeCdr();
std::unique_ptr<Target> MakeConsoleRoute();
std::unique_ptr<Target> MakeConsoleHttp();
std::unique_ptr<Target> MakeHandleSerial();
std::unique_ptr<Target> MakeHapticsGate();
std::unique_ptr<Target> MakeSpaceMouse();

}  // namespace fulcrum::fuzz
