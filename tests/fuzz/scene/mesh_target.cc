// Any bytes as a mesh file of one format: read to a valid mesh or refused.
#include "tests/fuzz/scene/mesh_check.h"
#include "tests/fuzz/target.h"

namespace fulcrum::fuzz {
namespace {

class Mesh final : public Target {
 public:
  explicit Mesh(const std::string& format) {
    for (scene::MeshSample& sample : scene::MeshSamples()) {
      // All have the same companions.
      if (sample.name == "a." + format && (samples_.empty() || sample.beside == samples_.front().beside)) {
        samples_.push_back(std::move(sample));
      }
    }
  }
  Outcome Offer(Input input) override {
    const bool taken = scene::CheckBytes(samples_.front(), std::string(TextOf(input)));
    return taken ? Outcome::kAccepted : Outcome::kRefused;
  }
  std::vector<Seed> Seeds() override {
    std::vector<Seed> seeds;
    for (const scene::MeshSample& sample : samples_) seeds.push_back({sample.label, BytesOf(sample.bytes)});
    return seeds;
  }

 private:
  std::vector<scene::MeshSample> samples_;
};

}  // namespace

std::unique_ptr<Target> MakeMeshMsh() { return std::make_unique<Mesh>("msh"); }
std::unique_ptr<Target> MakeMeshVtk() { return std::make_unique<Mesh>("vtk"); }
std::unique_ptr<Target> MakeMeshVtu() { return std::make_unique<Mesh>("vtu"); }
std::unique_ptr<Target> MakeMeshEle() { return std::make_unique<Mesh>("ele"); }
std::unique_ptr<Target> MakeMeshFace() { return std::make_unique<Mesh>("face"); }
std::unique_ptr<Target> MakeMeshStl() { return std::make_unique<Mesh>("stl"); }
std::unique_ptr<Target> MakeMeshObj() { return std::make_unique<Mesh>("obj"); }
std::unique_ptr<Target> MakeMeshPly() { return std::make_unique<Mesh>("ply"); }

}  // namespace fulcrum::fuzz
