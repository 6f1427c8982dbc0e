// Every lit surface. The texture coordinate means what the fragment shader says.
#version 130

in vec4 osg_Vertex;
in vec3 osg_Normal;
in vec4 osg_Color;
in vec4 osg_MultiTexCoord0;
uniform mat4 osg_ModelViewProjectionMatrix;
uniform mat4 osg_ModelViewMatrix;
uniform mat3 osg_NormalMatrix;
out vec3 position;
out vec3 normal;
out vec4 colour;
out vec4 coordinate;

void main() {
  gl_Position = osg_ModelViewProjectionMatrix * osg_Vertex;
  position = (osg_ModelViewMatrix * osg_Vertex).xyz;
  normal = osg_NormalMatrix * osg_Normal;
  colour = osg_Color;
  coordinate = osg_MultiTexCoord0;
}
