// The black rim round the picture, in clip coordinates, at the near plane: what lies behind is never shaded.
#version 130

in vec4 osg_Vertex;

void main() { gl_Position = vec4(osg_Vertex.xy, -1.0, 1.0); }
