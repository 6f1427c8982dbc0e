// The black rim around the picture, in clip coordinates, at the near plane, so that fragments behind it are not shaded.
#version 130

in vec4 osg_Vertex; // In radii of the picture's circle.
uniform vec2 circle_radius;  // [pixels]
uniform vec2 picture_centre; // [pixels]

void main() { gl_Position = vec4(osg_Vertex.xy * circle_radius / picture_centre, -1.0, 1.0); }
