// First pass of the membrane: depth only, so that the second pass blends the nearest layer alone and folds need no
// sorting. coordinate: material (s, t) [m], side (see geometry/membrane_mesh.h).
in vec4 coordinate;
uniform sampler2D atlas;
uniform vec2 atlas_per_metre;

void main() {
  if (coordinate.z < 0.0 || texture(atlas, coordinate.xy * atlas_per_metre).a < 0.5) discard;
}
