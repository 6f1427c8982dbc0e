// Vertex shader of all lit surfaces. The meaning of the texture coordinate is defined by the fragment shader.
#version 130

in vec4 osg_Vertex;
in vec3 osg_Normal;
in vec4 osg_Color;
in vec4 osg_MultiTexCoord0;
uniform mat4 osg_ModelViewMatrix;
uniform mat4 osg_ProjectionMatrix;
uniform mat3 osg_NormalMatrix;
uniform vec3 shift;    // Displacement of the whole mesh [m].
uniform float behind;  // Distance added in the depth test where surfaces overlap [m].
out vec3 position;
out vec3 normal;
out vec4 colour;
out vec4 coordinate;

void main() {
  position = (osg_ModelViewMatrix * (osg_Vertex + vec4(shift, 0.0))).xyz;
  // Moved along the line of sight; the position in the picture does not change.
  gl_Position = osg_ProjectionMatrix * vec4(position * (1.0 + behind / length(position)), 1.0);
  normal = osg_NormalMatrix * osg_Normal;
  colour = osg_Color;
  coordinate = osg_MultiTexCoord0;
}
