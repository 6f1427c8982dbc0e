// libFuzzer target: any bytes as a mesh file. They parse or are refused.
#include <cstddef>
#include <cstdint>
#include <string>

#include "services/base/core/error.h"
#include "tests/fuzz/scene/mesh_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace fulcrum::scene;
  MeshSample sample{"", "a." FULCRUM_MESH_FORMAT, {}, {}, false};
  for (const MeshSample& valid : MeshSamples()) {
    if (valid.name == sample.name) {
      sample.beside = valid.beside;
    }
  }
  CheckBytes(sample, std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
