// What lips and strands of a whole cut cost: finding them after a change of the cut, following the tissue, and their
// share of a picture's processor time, all threads together. Pictures with and without them are drawn in turns.
#include <ctime>
#include <osg/Geode>
#include <osg/NodeVisitor>
#include <vector>

#include "render_node/geometry/cut_lip.h"
#include "render_node/geometry/cut_strands.h"
#include "tests/benchmark/render/parts.h"

namespace fulcrum::render {
namespace {

constexpr double kEnd_s = 20;  // Of the script of built-in: all is cut.

class FindLips final : public osg::NodeVisitor {
 public:
  FindLips() : osg::NodeVisitor(TRAVERSE_ALL_CHILDREN) { setNodeMaskOverride(~0u); }
  void apply(osg::Geode& geode) override {
    for (unsigned k = 0; k < geode.getNumDrawables(); ++k) {
      if (geode.getDrawable(k)->getName() == "cut") lips = geode.getDrawable(k);
    }
  }
  osg::Drawable* lips = nullptr;
};

}  // namespace

void CutFigures(const SceneView& scene, benchmark::Report* report) {
  if (!report->Wants("render.cut.")) return;
  const SyntheticMoment moment = MakeSyntheticMoment(scene, kEnd_s);
  SampledView sampled(scene, moment, 1, 1.0f);
  LaparoscopeView& view = sampled.laparoscope;
  view.Update();

  MembraneMesh mesh(scene);
  mesh.SetTopology(moment.topology);
  mesh.Update(moment.tissue.xyz);
  SheetPlaces places(scene);
  CutLip lip(scene);
  CutStrands strands(scene);
  CutGeometry drawn;
  const int repeats = report->quick() ? 40 : 200;
  const auto find = benchmark::TimeMs(3, repeats, [&] {
    places.SetTopology(mesh);
    lip.Find(view.atlas(), mesh, places);
    strands.Find(view.atlas(), mesh, places);
  });
  const auto follow = benchmark::TimeMs(3, repeats, [&] {
    drawn.Clear();
    lip.Append(mesh, &drawn);
    strands.Append(mesh, scene.render.scope_tip_W, 700, &drawn);
  });
  const double follow_ms = benchmark::Quantile(follow, 0.5);
  report->Add("render.cut.find_ms_p50", benchmark::Quantile(find, 0.5), "ms");
  report->Add("render.cut.follow_ms_p50", follow_ms, "ms");
  report->Add("render.cut.triangles", static_cast<double>(drawn.triangles.size()), "1");
  report->Add("render.cut.strands", static_cast<double>(strands.strands().size()), "1");

  FindLips finder;
  view.root()->accept(finder);
  if (finder.lips == nullptr) return;
  std::vector<double> with, without;
  for (int k = 0; k < 2 * repeats + 6; ++k) {
    const bool shown = k % 2 == 0;
    finder.lips->setNodeMask(shown ? ~0u : 0u);
    const double start = CpuMs(CLOCK_PROCESS_CPUTIME_ID);
    view.SetTissue(moment.tissue.xyz);
    view.Update();
    sampled.display->Draw();
    if (k >= 6) (shown ? with : without).push_back(CpuMs(CLOCK_PROCESS_CPUTIME_ID) - start);
  }
  const double rest = benchmark::Quantile(without, 0.5) - follow_ms;
  report->Add("render.cut.picture_cpu_ms_p50", benchmark::Quantile(with, 0.5), "ms");
  report->Add("render.cut.share_pct", 100 * (benchmark::Quantile(with, 0.5) - rest) / rest, "%");
}

}  // namespace fulcrum::render
