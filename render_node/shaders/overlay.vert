// Text over the picture, in clip coordinates.
#version 130

in vec4 osg_Vertex;
in vec4 osg_MultiTexCoord0;
in vec4 osg_Color;
out vec2 place;
out vec4 colour;

void main() {
  gl_Position = vec4(osg_Vertex.xy, -1.0, 1.0);
  place = osg_MultiTexCoord0.xy;
  colour = osg_Color;
}
