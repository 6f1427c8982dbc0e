#include "services/scene/format/scene_file.h"

namespace fulcrum::scene {

SceneView SceneData::View() const {
  SceneView view = fixed;
  view.rest_position = rest_position;
  view.inverse_mass = inverse_mass;
  view.tets = tets;
  view.tet_colours = tet_colours;
  view.tube_edges = tube_edges;
  view.tube_edge_colours = tube_edge_colours;
  view.membrane_rest_length = membrane_rest_length;
  view.bending = bending;
  view.bending_colours = bending_colours;
  view.bindings = bindings;
  view.binding_colours = binding_colours;
  view.tube_surface = tube_surface;
  view.solids = solids;
  view.attachments = attachments;
  view.sheets = sheets;
  view.surface_vertices = surface_vertices;
  view.surface_triangles = surface_triangles;
  view.membrane_material = membrane_material;
  view.static_surfaces = static_surfaces;
  view.static_vertices = static_vertices;
  view.static_triangles = static_triangles;
  view.protected_structures = protected_structures;
  view.protected_points = protected_points;
  view.tool_meshes = tool_meshes;
  view.tool_vertices = tool_vertices;
  view.tool_triangles = tool_triangles;
  view.script = script;
  view.planned_line = planned_line;
  return view;
}

}  // namespace fulcrum::scene
