// The list of the arrays of a scene, in file order, used by writer, reader, hash and validation.
#pragma once

#include "services/base/core/scene_view.h"

namespace fulcrum::scene {

/// Those of scenes with several bodies.
template <class View, class Visitor>
void ForEachBodySection(View& view, Visitor&& visit) {
  visit("solids", view.solids);
  visit("attachments", view.attachments);
  visit("sheets", view.sheets);
}

/// Those of every scene.
template <class View, class Visitor>
void ForEachUsualSection(View& view, Visitor&& visit) {
  visit("rest_position", view.rest_position);
  visit("inverse_mass", view.inverse_mass);
  visit("tets", view.tets);
  visit("tet_colours", view.tet_colours);
  visit("tube_edges", view.tube_edges);
  visit("tube_edge_colours", view.tube_edge_colours);
  visit("membrane_rest_length", view.membrane_rest_length);
  visit("bending", view.bending);
  visit("bending_colours", view.bending_colours);
  visit("bindings", view.bindings);
  visit("binding_colours", view.binding_colours);
  visit("tube_surface", view.tube_surface);
  visit("surface_vertices", view.surface_vertices);
  visit("surface_triangles", view.surface_triangles);
  visit("membrane_material", view.membrane_material);
  visit("static_surfaces", view.static_surfaces);
  visit("static_vertices", view.static_vertices);
  visit("static_triangles", view.static_triangles);
  visit("protected_structures", view.protected_structures);
  visit("protected_points", view.protected_points);
  visit("tool_meshes", view.tool_meshes);
  visit("tool_vertices", view.tool_vertices);
  visit("tool_triangles", view.tool_triangles);
  visit("script", view.script);
  visit("planned_line", view.planned_line);
}

/// Calls visit(name, span) for every array of the view (const or not). Names have at most 23 characters.
template <class View, class Visitor>
void ForEachSection(View& view, Visitor&& visit) {
  ForEachUsualSection(view, visit);
  ForEachBodySection(view, visit);
}

}  // namespace fulcrum::scene
