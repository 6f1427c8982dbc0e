#include "tests/benchmark/gpu_prototype/device_solve.h"

#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>

namespace fulcrum::physics::gpu_prototype {
namespace {

using implicit::kMatrixFloats;
using implicit::kStressFloats;
using implicit::kVertexFloats;

/// Of the kernels SheetTriangles and SheetLinearise.
constexpr std::size_t kTrianglePlanes = 18, kCouplingPlanes = 6, kLinearisedPlanes = 15;

std::string ReadKernels() {
  const std::string file = std::string(FULCRUM_SOURCE_DIR) + "/tests/benchmark/gpu_prototype/kernels.cl";
  std::ifstream in(file);
  if (!in) throw std::runtime_error("cannot read " + file);
  return {std::istreambuf_iterator<char>(in), {}};
}

void Append(const float* values, std::size_t count, std::vector<float>* to) {
  to->insert(to->end(), values, values + count);
}

}  // namespace

DeviceSolve::DeviceSolve(Device* device, HostCase* host, Rounding rounding)
    : device_(*device),
      host_(*host),
      inertia_(host->inertia.inertia),
      plane_(host->model.layout.plane),
      field_(host->model.layout.tube_floats + 3 * host->model.layout.plane),
      tube_(host->model.layout.tube_floats),
      vertices_(host->model.layout.tube_count),
      rows_(static_cast<std::size_t>(host->model.layout.rows)),
      sums_(host->scratch.row_sums.size()) {
  const implicit::LinearSystem system = host->System();
  const implicit::OrganModel& organ = host->model.organ;
  const auto number = [](const char* name, auto value) {
    return std::string(" -D") + name + "=" + std::to_string(value);
  };
  device_.Build(ReadKernels(), "-cl-std=CL1.2" + number("ROWS", rows_) + number("SLOTS", system.sheet.slots) +
                                   number("TUBE", tube_) + number("HAT_SLOTS", system.hats.slots) +
                                   (rounding == Rounding::kFused ? " -DCONTRACTED -cl-mad-enable" : ""));

  std::vector<float> planes;
  for (const float* kt : system.sheet_matrix.kt) Append(kt, plane_, &planes);
  for (const float* along : system.sheet_matrix.along) Append(along, plane_, &planes);
  for (const auto& half : system.sheet_matrix.coupling) {
    for (const float* coupling : half) Append(coupling, plane_, &planes);
  }
  for (const float* point : system.sheet_matrix.point) Append(point, plane_, &planes);
  for (std::size_t i = 0; i < plane_; ++i) planes.push_back(system.sheet.w[i] > 0 ? system.sheet.mass[i] : 0.0f);
  matrix_ = device_.MakeFrom(planes);
  planes.clear();
  for (const float* block : system.sheet_matrix.block) Append(block, plane_, &planes);
  levels_ = device_.MakeFrom(planes);
  planes.clear();
  Append(system.hats.own, host->model.layout.stride, &planes);
  Append(system.hats.next, host->model.layout.stride, &planes);
  hat_weights_ = device_.MakeFrom(planes);
  hat_cell_ = device_.MakeFrom(std::vector<int>(system.hats.cell, system.hats.cell + rows_));
  hat_fraction_ = device_.MakeFrom(std::vector<float>(system.hats.fraction, system.hats.fraction + rows_));
  const std::size_t hat_floats = static_cast<std::size_t>(system.hats.rows) * host->state.coarse.row_width();
  hat_value_ = device_.MakeFrom(std::vector<float>(hat_floats, 0.0f));
  row_sums_ = device_.Make(sizeof(float) * sums_);

  organ_c_ = device_.MakeFrom(host->state.linearisation.organ_c);
  organ_f_ = device_.MakeFrom(host->state.linearisation.organ_f);
  organ_mass_ = device_.MakeFrom(organ.mass);
  start_ = device_.MakeFrom(organ.start);
  vertex_ = device_.MakeFrom(organ.vertex);
  gradient_ = device_.MakeFrom(organ.gradient);
  patch_start_ = device_.MakeFrom(organ.patch_start);
  patch_ = device_.MakeFrom(organ.patch);
  patch_gradient_ = device_.MakeFrom(organ.patch_gradient);

  for (const implicit::Task& task : host->state.regions.computed().tasks) {
    std::vector<int>& bounds = task.sheet ? sheet_bounds_ : organ_bounds_;
    bounds.push_back(task.first);
    bounds.push_back(task.end);
  }
  sheet_bounds_of_tasks_ = device_.MakeFrom(sheet_bounds_);
  organ_bounds_of_tasks_ = device_.MakeFrom(organ_bounds_);
  sheet_sums_.resize(sheet_bounds_.size() / 2);
  organ_sums_.resize(organ_bounds_.size() / 2);
  sheet_partial_ = device_.Make(sizeof(double) * sheet_sums_.size());
  organ_partial_ = device_.Make(sizeof(double) * organ_sums_.size());

  CopyLaw(system.sheet);
  r_ = device_.MakeFrom(std::vector<float>(field_, 0.0f));
  z_ = device_.MakeFrom(std::vector<float>(field_, 0.0f));
  p_ = device_.MakeFrom(std::vector<float>(field_, 0.0f));
  q_ = device_.MakeFrom(std::vector<float>(field_, 0.0f));
  d_ = device_.MakeFrom(std::vector<float>(field_, 0.0f));
  pulls_ = device_.Make(sizeof(float) * 9 * plane_);
  lines_ = device_.Make(sizeof(float) * kStressFloats * (vertices_ + 1));
  sheet_dots_ = device_.Make(sizeof(float) * plane_);
  organ_dots_ = device_.Make(sizeof(float) * vertices_);
  lanes_ = device_.Make(sizeof(float) * kLanes * rows_);
}

/// What the linearisation reads.
void DeviceSolve::CopyLaw(const implicit::Sheet& sheet) {
  std::vector<float> planes;
  for (const float* a : sheet.triangle) Append(a, plane_, &planes);
  for (const auto& half : sheet.trace) {
    for (const float* alpha : half) Append(alpha, plane_, &planes);
  }
  law_ = device_.MakeFrom(planes);
  planes.clear();
  const auto fields = implicit::SheetFieldsAt(host_.context, host_.state, host_.state.linearisation.point, nullptr);
  for (const auto* field : {&fields.start, &fields.velocity, &fields.load}) {
    for (const float* plane : *field) Append(plane, plane_, &planes);
  }
  Append(fields.element_diagonal, plane_, &planes);
  fields_ = device_.MakeFrom(planes);
  triangles_ = device_.Make(sizeof(float) * kTrianglePlanes * plane_);
  linearised_ = device_.Make(sizeof(float) * kLinearisedPlanes * plane_);
}

void DeviceSolve::Linearise() {
  const implicit::Inertia& inertia = host_.inertia;
  device_.Launch("SheetTriangles", plane_, matrix_, law_, triangles_, host_.model.sheet.triangle_stiffening,
                 implicit::kLeastSheetDeterminant);
  device_.Launch("SheetLinearise", plane_, matrix_, triangles_, fields_, linearised_, inertia.inertia, 1.0f / inertia.h,
                 inertia.gravity[0], inertia.gravity[1], inertia.gravity[2]);
}

std::vector<float> DeviceSolve::ReadLinearisation() {
  std::vector<float> planes((kLinearisedPlanes + kCouplingPlanes) * plane_);
  device_.Read(linearised_, 0, planes.data(), kLinearisedPlanes * plane_);
  device_.Read(triangles_, (kTrianglePlanes - kCouplingPlanes) * plane_, planes.data() + kLinearisedPlanes * plane_,
               kCouplingPlanes * plane_);
  return planes;
}

void DeviceSolve::SetDirection(const FloatArray& z) { device_.Write(z_, 0, z.data(), field_); }
void DeviceSolve::ReadProduct(FloatArray* q) { device_.Read(q_, 0, q->data(), field_); }

void DeviceSolve::ApplySheet(Product how) {
  if (how == Product::kOneLaunch) {
    device_.Launch("SheetApply", plane_, matrix_, z_, q_, sheet_dots_, inertia_);
    return;
  }
  device_.Launch("SheetPulls", plane_, matrix_, z_, pulls_);
  device_.Launch("SheetGather", plane_, matrix_, pulls_, z_, q_, sheet_dots_, inertia_);
}

void DeviceSolve::ApplyOrgan() {
  device_.Launch("OrganStress", vertices_, start_, vertex_, gradient_, organ_c_, organ_f_, z_, lines_);
  device_.Launch("OrganApply", vertices_, patch_start_, patch_, patch_gradient_, lines_, organ_mass_, z_, q_,
                 organ_dots_, inertia_);
}

void DeviceSolve::Curvature() {
  device_.Launch("SheetCurvature", plane_, matrix_, z_, sheet_dots_, inertia_);
  device_.Launch("OrganCurvature", vertices_, start_, vertex_, gradient_, organ_c_, organ_f_, organ_mass_, z_, lines_,
                 organ_dots_, inertia_);
}

void DeviceSolve::SumSheet(bool parity) {
  device_.Launch("LaneSums", kLanes * rows_, sheet_dots_, lanes_, parity ? 1 : 0);
  device_.Launch("RowTaskSums", sheet_sums_.size(), lanes_, sheet_bounds_of_tasks_, sheet_partial_);
}
void DeviceSolve::SumOrgan() {
  device_.Launch("VertexTaskSums", organ_sums_.size(), organ_dots_, organ_bounds_of_tasks_, organ_partial_);
}

Dots DeviceSolve::Sums() const {
  Dots sums;
  for (const double of_task : sheet_sums_) {
    sums.sheet += of_task;
    sums.all += of_task;
  }
  for (const double of_task : organ_sums_) {
    sums.organ += of_task;
    sums.all += of_task;
  }
  return sums;
}

Dots DeviceSolve::ReadDots() {
  SumSheet(true);
  SumOrgan();
  ReadSheet();
  ReadOrgan();
  return Sums();
}

void DeviceSolve::Restrict() { device_.Launch("Restrict", sums_ / 3, matrix_, hat_weights_, r_, row_sums_); }
void DeviceSolve::Precondition() {
  device_.Launch("Precondition", plane_, matrix_, levels_, hat_weights_, hat_value_, hat_cell_, hat_fraction_, r_, z_,
                 sheet_dots_);
  SumSheet(false);
}

void DeviceSolve::ExchangeLevels() {
  const implicit::LinearSystem system = host_.System();
  device_.Read(row_sums_, 0, host_.scratch.row_sums.data(), sums_);
  device_.Read(r_, 0, host_.state.linearisation.residual.data(), kVertexFloats * vertices_);
  host_.SolveLevels(system, &organ_sums_);
  device_.Write(hat_value_, 0, system.hats.value,
                static_cast<std::size_t>(system.hats.rows) * host_.state.coarse.row_width());
  device_.Write(z_, 0, host_.scratch.krylov.z.data(), kVertexFloats * vertices_);
}

void DeviceSolve::Solve(FloatArray* d) {
  device_.Write(r_, 0, host_.state.linearisation.residual.data(), field_);
  const auto precondition = [this] {
    Restrict();
    ExchangeLevels();
    Precondition();
    ReadSheet();
    return Sums().all;
  };
  const double rz = precondition();
  ApplySheet(Product::kTwoLaunches);
  ApplyOrgan();
  const double curvature = ReadDots().all;
  const auto alpha = static_cast<float>(rz / curvature);
  device_.Launch("Add", field_, r_, q_, -alpha);
  std::swap(z_, p_);
  const double next = precondition();
  const auto beta = static_cast<float>(next / rz);
  Curvature();
  const double last = ReadDots().all - static_cast<double>(beta) * static_cast<double>(beta) * curvature;
  const auto last_alpha = static_cast<float>(next / last);
  device_.Launch("Step", field_, d_, p_, z_, alpha + last_alpha * beta, last_alpha);
  device_.Read(d_, 0, d->data(), field_);
}

void DeviceSolve::Queue() {
  Restrict();
  Precondition();
  ApplySheet(Product::kTwoLaunches);
  ApplyOrgan();
  SumSheet(true);
  SumOrgan();
  device_.Launch("Add", field_, r_, q_, 0.0f);
  Restrict();
  Precondition();
  Curvature();
  SumSheet(true);
  SumOrgan();
  device_.Launch("Step", field_, d_, p_, z_, 0.0f, 0.0f);
}

}  // namespace fulcrum::physics::gpu_prototype
