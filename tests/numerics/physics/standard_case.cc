#include "tests/numerics/physics/standard_case.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <future>

#include "services/base/core/hash.h"
#include "tests/numerics/physics/reference/explicit_dynamics.h"
#include "tests/numerics/physics/reference/static_solver.h"

namespace fulcrum::physics {
namespace {

using reference::ElasticEnergy;
using reference::ExplicitDynamics;
using reference::Points;

/// Step length relative to the largest stable step at rest. The margin covers the stiffening of the sheet by the
/// stretch.
constexpr double kPartOfStableStep = 0.75;
/// Version of the computation of the reference; increment it with each change of that computation.
constexpr std::uint64_t kGenerator = 1;

std::vector<bool> Mask(const std::vector<Index>& particles, std::size_t count) {
  std::vector<bool> mask(3 * count, false);
  for (const Index p : particles) {
    std::fill_n(mask.begin() + 3 * static_cast<std::ptrdiff_t>(p), 3, true);
  }
  return mask;
}

Vec3d ForceOn(const ElasticEnergy& energy, const Points& x, const std::vector<Index>& particles) {
  Points gradient;
  energy.Gradient(x, &gradient);
  Vec3d force = Vec3d::Zero();
  for (const Index p : particles) {
    force -= gradient.col(p);
  }
  return force;
}

/// Sums of squares of differences from a reference and of its displacement, over any number of frames.
class RmsError {
 public:
  /// @param displaced displacement of the truth, or a substitute for it.
  void Add(const Points& x, const Points& truth, const Points& displaced) {
    error_ += (x - truth).squaredNorm();
    displacement_ += displaced.squaredNorm();
  }
  [[nodiscard]] double value() const { return std::sqrt(error_ / displacement_); }

 private:
  double error_ = 0, displacement_ = 0;
};

double StrainDifference(const ElasticModel& model, const Points& x, const Points& y) {
  double sum = 0;
  std::size_t count = 0;
  for (const ElasticSpring& s : model.springs) {
    if (s.axial > 0) {
      const double d = ((x.col(s.b) - x.col(s.a)).norm() - (y.col(s.b) - y.col(s.a)).norm()) / s.rest_length;
      sum += d * d;
      ++count;
    }
  }
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(count, 1)));
}

double TetVolumeDifference(const ElasticModel& model, const Points& x, const Points& y) {
  double sum = 0;
  for (const ElasticTet& tet : model.tets) {
    const double d = (reference::TetVolume(tet, x) - reference::TetVolume(tet, y)) / tet.volume;
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(model.tets.size(), 1)));
}

Points ReadPoints(const SolverUnderTest& solver, Eigen::Index count) {
  Eigen::Matrix<float, 3, Eigen::Dynamic> xyz(3, count);
  solver.ReadPositions({xyz.data(), static_cast<std::size_t>(xyz.size())});
  return xyz.cast<double>();
}

// ------------------------------------------------------------------------------------------------------- the file

template <class T>
void Put(std::ostream& out, const T& value) {
  out.write(reinterpret_cast<const char*>(&value), sizeof(T));
}
void PutPoints(std::ostream& out, const Points& x) {
  out.write(reinterpret_cast<const char*>(x.data()), static_cast<std::streamsize>(sizeof(double)) * x.size());
}
template <class T>
T Get(std::istream& in) {
  T value{};
  in.read(reinterpret_cast<char*>(&value), sizeof(T));
  return value;
}
Points GetPoints(std::istream& in, Eigen::Index count) {
  Points x(3, count);
  in.read(reinterpret_cast<char*>(x.data()), static_cast<std::streamsize>(sizeof(double)) * x.size());
  return x;
}

constexpr int kFrameCount = StandardCase::kFrames / StandardCase::kSampleFrames;
constexpr int kCutFrameCount = (StandardCase::kPullFrames - StandardCase::kCutFrame) / StandardCase::kSampleFrames;

void Write(const std::filesystem::path& file, std::uint64_t hash, const StandardCase::Reference& r) {
  std::filesystem::create_directories(file.parent_path());
  const std::filesystem::path temporary = file.string() + ".new";
  {
    std::ofstream out(temporary, std::ios::binary);
    Put(out, hash);
    Put(out, r.equilibrium_residual_N);
    Put(out, r.hold_residual_N);
    Put(out, r.step_s);
    Put(out, r.force_N);
    PutPoints(out, r.equilibrium);
    PutPoints(out, r.hold);
    for (const auto* frames : {&r.frames, &r.cut_frames}) {
      for (const Points& x : *frames) {
        PutPoints(out, x);
      }
    }
    Put(out, hash);
  }
  std::filesystem::rename(temporary, file);
}

bool Read(const std::filesystem::path& file, std::uint64_t hash, Eigen::Index count, StandardCase::Reference* r) {
  std::ifstream in(file, std::ios::binary);
  if (!in || Get<std::uint64_t>(in) != hash) {
    return false;
  }
  r->equilibrium_residual_N = Get<double>(in);
  r->hold_residual_N = Get<double>(in);
  r->step_s = Get<double>(in);
  r->force_N = Get<Vec3d>(in);
  r->equilibrium = GetPoints(in, count);
  r->hold = GetPoints(in, count);
  for (int i = 0; i < kFrameCount; ++i) {
    r->frames.push_back(GetPoints(in, count));
  }
  for (int i = 0; i < kCutFrameCount; ++i) {
    r->cut_frames.push_back(GetPoints(in, count));
  }
  return Get<std::uint64_t>(in) == hash && in.good();
}

}  // namespace

StandardCase::StandardCase(scene::SceneData data, const StandardCaseSettings& settings)
    : settings_(settings), data_(std::move(data)) {
  PhysicsParams& physics = data_.fixed.physics;
  physics.dt_s = static_cast<float>(kFrame_s);
  physics.gravity.setZero();
  physics.damping_per_s = 20;
  physics.tube_youngs_modulus_Pa = 1e5f;
  physics.tube_poisson = 0.45f;
  physics.membrane_Et_N_per_m = 300;
  physics.membrane_prestrain = 0.04f;
  physics.membrane_stiffening = 0;
  physics.membrane_model = settings.membrane;
  view_ = data_.View();
  model_ = BuildElasticModel(view_);
  const int rows = static_cast<int>(view_.membrane.rows), cols = static_cast<int>(view_.membrane.cols);
  const int first_row = (rows - settings.patch_rows) / 2, first_col = (cols - settings.patch_cols) / 2;
  for (int r = first_row; r < first_row + settings.patch_rows; ++r) {
    for (int c = first_col; c < first_col + settings.patch_cols; ++c) {
      held_.push_back(view_.membrane.first + static_cast<Index>(r * cols + c));
    }
  }
  const int slit_row = (rows - settings.slit_rows) / 2, slit_col = cols / 2 + settings.slit_offset_cols;
  for (int r = slit_row; r < slit_row + settings.slit_rows; ++r) {
    const auto node = static_cast<std::size_t>(r * cols + slit_col);
    cut_edges_.push_back(3 * node);      // Along the row,
    cut_edges_.push_back(3 * node + 2);  // and the diagonal: the edges from this column to the next.
  }
}

StandardCase::Reference StandardCase::ComputeReference(int steps_per_frame) const {
  const ElasticEnergy energy(model_);
  Reference result;
  const reference::StaticResult start = SolveStatic(energy, reference::RestPoints(model_), {}, {});
  result.equilibrium = start.x;
  result.equilibrium_residual_N = start.residual_N;
  if (steps_per_frame == 0) {
    const double stable = 2 / HighestFrequency(energy, start.x);
    steps_per_frame = static_cast<int>(std::ceil(kFrame_s / (kPartOfStableStep * stable)));
  }
  result.step_s = kFrame_s / steps_per_frame;
  const auto motion = [this, &result](Index p, double time_s) {
    return Vec3d(result.equilibrium.col(p) + Lift(time_s / kFrame_s) * Vec3d::UnitZ());
  };
  ExplicitDynamics dynamics(&energy, start.x, result.step_s);
  dynamics.Hold(held_, motion);
  std::future<std::vector<Points>> cut;
  std::future<reference::StaticResult> hold;
  for (int frame = 1; frame <= kFrames; ++frame) {
    dynamics.Run(steps_per_frame);
    if (frame % kSampleFrames == 0) {
      result.frames.push_back(dynamics.x());
    }
    // The branches run beside the main run: each has its own energy, so the result does not depend on the order.
    if (frame == kCutFrame) {
      cut = std::async(std::launch::async, [this, dynamics, steps_per_frame]() mutable {
        ElasticEnergy slit(model_);
        for (const std::size_t edge : cut_edges_) {
          slit.CutEdge(edge);
        }
        dynamics.ChangeEnergy(&slit);
        std::vector<Points> frames;
        for (int f = kCutFrame + 1; f <= kPullFrames; ++f) {
          dynamics.Run(steps_per_frame);
          if (f % kSampleFrames == 0) {
            frames.push_back(dynamics.x());
          }
        }
        return frames;
      });
    }
    if (frame == kHoldFrames) {
      hold = std::async(std::launch::async, [this, guess = dynamics.x()]() {
        return SolveStatic(ElasticEnergy(model_), guess, Mask(held_, model_.mass.size()), {});
      });
      dynamics.Hold({}, {});
    }
  }
  result.cut_frames = cut.get();
  const reference::StaticResult still = hold.get();
  result.hold = still.x;
  result.hold_residual_N = still.residual_N;
  result.force_N = ForceOn(energy, still.x, held_);
  return result;
}

std::uint64_t StandardCase::Hash() const {
  Hash64 hash;
  hash.AddValue(kGenerator);
  const auto add = [&hash](const auto& values) { hash.Add(std::as_bytes(std::span(values))); };
  add(model_.rest_position);
  add(model_.mass);
  add(model_.load);
  for (const ElasticSpring& s : model_.springs) {
    hash.AddValue(s.a);
    hash.AddValue(s.b);
    hash.AddValue(s.rest_length);
    hash.AddValue(s.axial);
  }
  for (const ElasticTriangle& triangle : model_.triangles) {
    hash.AddValue(triangle.rest.stiffness);
    add(triangle.rest.trace);
  }
  for (const ElasticHinge& h : model_.hinges) {
    hash.AddValue(h.v[0]);
    hash.AddValue(h.stiffness);
  }
  for (const ElasticPatchLink& link : model_.patch_links) {
    hash.AddValue(link.v);
    add(std::span(link.gradient.data(), 3));
  }
  for (const ElasticShearLink& link : model_.shear_links) {
    hash.AddValue(link.stiffness);
  }
  for (const ElasticBinding& b : model_.bindings) {
    hash.AddValue(b.membrane);
    hash.AddValue(b.stiffness);
  }
  for (const double value :
       {model_.mu_Pa, model_.lambda_Pa, model_.damping_per_s, model_.stiffening, settings_.lift_m}) {
    hash.AddValue(value);
  }
  add(held_);
  add(cut_edges_);
  return hash.value();
}

StandardCase::Reference StandardCase::LoadReference(const std::filesystem::path& folder) const {
  const char* const model = settings_.membrane == MembraneModel::kSprings ? ".springs" : "";
  const std::filesystem::path file = folder / (std::string(view_.name) + model + ".reference");
  Reference result;
  if (!Read(file, Hash(), static_cast<Eigen::Index>(model_.mass.size()), &result)) {
    std::fprintf(stderr, "computing %s\n", file.c_str());
    result = ComputeReference();
    Write(file, Hash(), result);
  }
  return result;
}

StandardRun RunStandardCase(const StandardCase& standard, const StandardCase::Reference& truth,
                            const SolverFactory& make, const SceneView& scene, bool with_cut) {
  const ElasticModel& model = standard.model();
  const Points& start = truth.equilibrium;
  const Eigen::Matrix<float, 3, Eigen::Dynamic> start_xyz = start.cast<float>();
  StandardRun run;
  for (const bool cut : {false, true}) {
    if (cut && !with_cut) {
      break;
    }
    const std::unique_ptr<SolverUnderTest> solver = make(scene);
    solver->SetPositions({start_xyz.data(), static_cast<std::size_t>(start_xyz.size())});
    solver->Hold(standard.held());
    std::vector<Vec3f> places(standard.held().size());
    RmsError pull, release, after_cut;
    const int frames = cut ? StandardCase::kPullFrames : StandardCase::kFrames;
    for (int frame = 1; frame <= frames; ++frame) {
      for (std::size_t i = 0; i < places.size(); ++i) {
        const Vec3d place = start.col(standard.held()[i]) + standard.Lift(frame) * Vec3d::UnitZ();
        places[i] = place.cast<float>();
      }
      if (frame == StandardCase::kHoldFrames + 1) {
        solver->Hold({});
        places.clear();
      }
      const auto before = std::chrono::steady_clock::now();
      if (cut && frame == StandardCase::kCutFrame + 1) {
        solver->CutEdges(standard.cut_edges());
      }
      solver->MoveHeld(places);
      solver->Step();
      const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - before;
      if (!cut) {
        run.frame_ms.push_back(took.count());
      } else if (frame > StandardCase::kCutFrame) {
        run.cut_frame_ms.push_back(took.count());
      }
      if (frame % StandardCase::kSampleFrames != 0) {
        continue;
      }
      const Points x = ReadPoints(*solver, start.cols());
      const auto sample = static_cast<std::size_t>(frame / StandardCase::kSampleFrames - 1);
      if (cut) {
        if (frame >= StandardCase::kCutSettled) {
          const std::size_t first = StandardCase::kCutFrame / StandardCase::kSampleFrames;
          const Points& y = truth.cut_frames[sample - first];
          after_cut.Add(x, y, y - start);
        }
      } else if (frame <= StandardCase::kPullFrames) {
        pull.Add(x, truth.frames[sample], truth.frames[sample] - start);
      } else if (frame > StandardCase::kHoldFrames) {
        release.Add(x, truth.frames[sample], truth.hold - start);
      }
      if (!cut && frame == StandardCase::kHoldFrames) {
        RmsError hold;
        hold.Add(x, truth.hold, truth.hold - start);
        run.errors.hold = hold.value();
        run.errors.hold_max_m = (x - truth.hold).colwise().norm().maxCoeff();
        const Vec3d force = ForceOn(ElasticEnergy(model), x, standard.held());
        run.errors.force = (force - truth.force_N).norm() / truth.force_N.norm();
        const double volume = reference::OrganVolume(model, truth.hold);
        run.errors.volume = std::abs(reference::OrganVolume(model, x) - volume) / volume;
        run.errors.tet_volume = TetVolumeDifference(model, x, truth.hold);
        run.errors.strain = StrainDifference(model, x, truth.hold);
      }
    }
    (cut ? run.errors.cut : run.errors.pull) = cut ? after_cut.value() : pull.value();
    if (!cut) {
      run.errors.release = release.value();
    }
  }
  return run;
}

}  // namespace fulcrum::physics
