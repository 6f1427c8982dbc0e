// A strip along a straight edge, in the pixels of an eye's part of the picture (scene_graph/edge_lines.h).
#version 130

in vec4 osg_Vertex;          // Place [pixels]; distance from the edge, positive outside [pixels].
in vec3 osg_Normal;          // Of the edge, outward; 1: a crease, 2: the rim of the round field.
in vec4 osg_MultiTexCoord0;  // Window depths between which the surface inside lies; least one outside.
uniform vec2 eye_pixels;     // Size of the part.
uniform vec2 circle_radius;  // [pixels of the scene]
uniform vec2 picture_centre;
uniform vec2 texture_scale;
uniform vec4 part;
uniform vec2 border;
out vec2 place;
out vec2 in_field;  // Radii from the middle of the round field.
out vec4 across;    // Normal, distance, kind.
out vec3 depths;

void main() {
  vec2 clip = 2.0 * osg_Vertex.xy / eye_pixels - 1.0;
  gl_Position = vec4(part.xy + part.zw * clip, 0.0, 1.0);
  gl_ClipDistance[0] = 1.0 - dot(border, clip);
  place = (0.5 + 0.5 * clip) * texture_scale;
  in_field = clip * picture_centre / circle_radius;
  across = vec4(osg_Normal.xy, osg_Vertex.z, osg_Normal.z);
  depths = osg_MultiTexCoord0.xyz;
}
