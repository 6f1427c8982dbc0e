// A puff of steam: a square that faces the camera. osg_Vertex: its centre; coordinate: corner (-1 … 1), radius [m],
// opacity.
#version 130

in vec4 osg_Vertex;
in vec4 osg_MultiTexCoord0;
uniform mat4 osg_ModelViewMatrix;
uniform mat4 osg_ProjectionMatrix;
out vec3 position;
out vec2 corner;
out float opacity;

void main() {
  vec4 centre = osg_ModelViewMatrix * osg_Vertex;
  corner = osg_MultiTexCoord0.xy;
  opacity = osg_MultiTexCoord0.w;
  position = centre.xyz;
  gl_Position = osg_ProjectionMatrix * (centre + vec4(corner * osg_MultiTexCoord0.z, 0.0, 0.0));
}
