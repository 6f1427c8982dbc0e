// The round field of the optics, in clip coordinates.
#version 130

in vec4 osg_Vertex; // In radii of the picture's circle.
uniform vec2 circle_radius;  // [pixels]
uniform vec2 picture_centre; // [pixels]
uniform vec2 texture_scale;
uniform vec4 part;   // Of the picture, for this eye: its centre and half its size in clip coordinates.
uniform vec2 border; // Towards the other eye's part, which the field does not enter; 0: none.
out vec2 place;

void main() {
  vec2 clip = osg_Vertex.xy * circle_radius / picture_centre;
  gl_Position = vec4(part.xy + part.zw * clip, 0.0, 1.0);
  gl_ClipDistance[0] = 1.0 - dot(border, clip);
  place = (0.5 + 0.5 * clip) * texture_scale;
}
