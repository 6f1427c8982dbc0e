// The round field of the optics, in clip coordinates.
#version 130

in vec4 osg_Vertex; // In radii of the picture's circle.
uniform float circle_radius; // [pixels]
uniform vec2 picture_centre; // [pixels]
uniform vec2 texture_scale;
out vec2 place;

void main() {
  vec2 clip = osg_Vertex.xy * circle_radius / picture_centre;
  gl_Position = vec4(clip, 0.0, 1.0);
  place = (0.5 + 0.5 * clip) * texture_scale;
}
