// The black rim around the picture, in clip coordinates, at the near plane, so that fragments behind it are not shaded.
#version 130

in vec4 osg_Vertex;

void main() { gl_Position = vec4(osg_Vertex.xy, -1.0, 1.0); }
