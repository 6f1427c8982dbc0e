// The shadow of an instrument: a ribbon on the tissue. coordinate: see geometry/tool_shadow.h.
#version 130

in vec4 osg_Vertex;
in vec4 osg_MultiTexCoord0;
uniform mat4 osg_ModelViewMatrix;
uniform mat4 osg_ProjectionMatrix;
out vec4 coordinate;

void main() {
  vec3 position = (osg_ModelViewMatrix * osg_Vertex).xyz;
  // Moved towards the eye; the position in the picture does not change.
  gl_Position = osg_ProjectionMatrix * vec4(position * (1.0 - osg_MultiTexCoord0.w / length(position)), 1.0);
  coordinate = osg_MultiTexCoord0;
}
