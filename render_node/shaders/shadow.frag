// Reduces the light; the remaining light is the red that tissue scatters.
#version 130

in vec4 coordinate;
out vec4 fragment;

void main() {
  float lit = smoothstep(1.0 - coordinate.y, 1.0, abs(coordinate.x));
  fragment = vec4(0.10, 0.012, 0.010, coordinate.z * (1.0 - lit));
}
