in vec3 position;
in vec2 corner;
in float opacity;
uniform sampler2D noise_pattern;
out vec4 fragment;

void main() {
  float r2 = dot(corner, corner);
  float noise = texture(noise_pattern, corner * 0.15 + position.xy * 9.0).g;
  float alpha = opacity * max(0.0, 1.0 - r2) * clamp(2.4 * noise - 0.5, 0.0, 1.0);
  vec3 l;
  float e = Irradiance(position, l);
  fragment = vec4(ToneMap(vec3(0.50, 0.49, 0.48) * e), alpha);
}
