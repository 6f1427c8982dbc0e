// The deformable layers of tissue: organ with its burns, fat, membrane. Their meshes follow the particles; only visible
// triangles are passed to OpenGL.
#pragma once

#include <functional>
#include <memory>
#include <osg/Geode>
#include <osg/Program>
#include <span>
#include <vector>

#include "render_node/geometry/clip_footprint.h"
#include "render_node/geometry/fat_layer.h"
#include "render_node/geometry/field_of_view.h"
#include "render_node/geometry/membrane_mesh.h"
#include "render_node/geometry/sheet_detail.h"
#include "render_node/geometry/sheet_rim.h"
#include "render_node/scene_graph/burn_layer.h"
#include "render_node/scene_graph/cut_layer.h"
#include "render_node/scene_graph/mesh.h"
#include "render_node/scene_graph/order.h"

namespace fulcrum::render {

class TissueLayers {
 public:
  /// Keeps a reference to the arrays of `scene`. @param eyes of MakeEyes(): what one of them sees is drawn.
  TissueLayers(const SceneView& scene, std::span<const Laparoscope> eyes);

  /// Particles in scene order, 3 * n floats [m]. @pre n is the scene's count.
  void SetTissue(std::span<const float> xyz);
  /// Returns false, and changes nothing, if the topology belongs to another grid.
  bool SetTopology(const TopologyState& topology);
  /// Applies a patch of the solids. Returns false if it is of the membrane, lies outside or has the wrong size.
  bool Burn(const TemperaturePatch& patch) { return burn_.Apply(patch, geode_); }
  void SetEyes(std::span<const Laparoscope> eyes);
  /// Draws the membrane in so many triangles as a picture with `factor` times as many lines needs; 1 at first.
  void SetDetail(float factor);
  /// Pixels of the scene as a share of those of the picture: no strand is thinner than one of them.
  void SetScale(float scale);
  /// Draws a triangle of the fat if one of its corners is bared, `opened` or `visible`, as a function of (s, t) [m] and
  /// thickness 0 … 1; with lobules if one is bared or opened.
  void ShowFat(const std::function<bool(const Vec2f& material, float thickness)>& visible,
               const std::function<bool(const Vec2f& material)>& opened);
  /// Adds what only a burn shows, so that its shaders are compiled, or removes it: all fat as bared and, where solids
  /// burn, a piece of burnt tissue in front of everything (BurnLayer::Rehearse), and a piece of a lip.
  void RehearseBurn(bool on);
  /// Draws the sheets' tissue together along these lines, the first kMaxClips. Needs a scene with a clip applier.
  void Gather(std::span<const ClipFootprint> clips);
  /// Draws the vessels dark and thin whose texels in `cut_off` are not 0: one byte for each texel of the atlas' film.
  void Pale(const Atlas& atlas, std::span<const std::uint8_t> cut_off);
  /// Updates the meshes. Returns false if nothing has changed. @param atlas of the sheet.
  bool Update(const Atlas& atlas);

  [[nodiscard]] const MembraneMesh& membrane() const { return membrane_; }
  [[nodiscard]] std::span<const float> rim() const { return rim_; }  ///< Of SheetRim().
  [[nodiscard]] const BurnAtlas& burn_atlas() const { return burn_.atlas(); }
  [[nodiscard]] std::span<const float> particles() const { return xyz_; }  ///< Last argument of SetTissue.
  [[nodiscard]] bool seen() const { return seen_; }                        ///< SetTissue has been called.
  [[nodiscard]] osg::Geode* node() const { return geode_; }

 private:
  /// A mesh and the list of its triangles that were passed to OpenGL.
  struct Layer {
    std::unique_ptr<Mesh> mesh;
    std::vector<Triangle> seen;
  };
  void Add(Layer* layer, const char* name, Order order, osg::Program* program);
  void Show(Layer* layer, std::span<const Vec3f> positions, std::span<const Triangle> triangles, Sides sides);
  /// The visible surface of a solid.
  struct SolidLayer {
    Layer layer;
    Index first_vertex, vertex_count;
    std::vector<Triangle> triangles;  ///< Of its own vertices.
  };
  /// False where the paper's colours are drawn to the letter: they have no holes.
  void AddSolids();
  void AddSolid(const fulcrum::Solid& solid);  // Not the one of geometry/solid.h.
  void AddSheets();
  /// Adds the planned line of an exercise to the membrane.
  void AddPlannedLine();
  void UpdateSolids();
  void UpdateMembrane();
  /// Returns true if the atlas may have marked others than at the last call.
  bool FindUntouched(const Atlas& atlas);
  void ShowMembrane();
  void UpdateFat();
  void ChooseFat();

  SceneView scene_;
  FieldOfView field_;
  Vec3f eye_W_;
  float pixels_per_rad_;
  float detail_factor_ = 1;
  MembraneMesh membrane_;
  SheetDetail detail_;
  FatLayer fat_;
  std::vector<float> xyz_;
  std::vector<Vec3f> solid_positions_, solid_normals_;  ///< Of all solids.
  std::vector<Triangle> fat_shown_, fat_beneath_;       ///< With lobules; as a tint beneath the membrane.
  std::vector<std::uint8_t> fat_visible_, fat_opened_;  ///< Per vertex.
  std::vector<std::array<float, 4>> fat_coordinates_;
  std::vector<float> fat_bared_;  ///< As drawn.
  bool fat_chosen_ = false, rehearsing_ = false;
  SheetRuns chosen_, shown_;             // The membrane's triangles at the level of detail needed; those that are seen.
  std::vector<std::uint8_t> untouched_;  // Per block of the membrane's mesh.
  std::uint64_t marks_ = ~std::uint64_t{0};  // Atlas::marks() of untouched_.
  std::vector<ClipFootprint> gathered_;      // Of Gather().
  Eigen::AlignedBox2f pale_;                 // Around what Pale() shows, (s, t) [m].
  bool seen_ = false, regathered_ = false;
  // The membrane: meshes over the arrays of the first one, a run of triangles each.
  std::vector<std::unique_ptr<Mesh>> sheet_;
  osg::ref_ptr<osg::StateSet> touched_state_, untouched_state_;
  const std::vector<float> rim_;  // Per node of the membrane's grid (geometry/sheet_rim.h).
  float scale_ = 1;
  bool tissue_changed_ = true, topology_changed_ = true, scope_changed_ = true;
  bool recut_ = false;  // By a new topology.
  osg::ref_ptr<osg::Geode> geode_ = new osg::Geode;
  osg::ref_ptr<osg::Program> solid_program_;  ///< Of all solids: the rasteriser compiles each program.
  std::vector<SolidLayer> solids_;
  BurnLayer burn_;
  CutLayer cut_;
  Layer fat_layer_, beneath_layer_;
};

}  // namespace fulcrum::render
