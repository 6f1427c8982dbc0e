// The round field of the optics, in clip coordinates.
#version 130

in vec4 osg_Vertex;
uniform vec2 texture_scale;
out vec2 place;

void main() {
  gl_Position = vec4(osg_Vertex.xy, 0.0, 1.0);
  place = (0.5 + 0.5 * osg_Vertex.xy) * texture_scale;
}
