// The organ's serosa: wet pink-red with longitudinal muscle and small vessels.
// coordinate: place at rest along the organ's axis and across it both ways [m], and how much it faces the third axis.
in vec3 position;
in vec3 normal;
in vec4 coordinate;
uniform sampler2D noise_pattern;
uniform sampler2D vessel_pattern;
out vec4 fragment;

void main() {
  vec2 front = coordinate.xy, side = coordinate.xz;
  float facing = coordinate.w;
  vec4 noise = mix(texture(noise_pattern, side * 28.0), texture(noise_pattern, front * 28.0), facing);
  float vessel = texture(vessel_pattern, mix(side, front, step(0.5, facing)) * 20.0).r;
  vec3 bend = noise.rgb - 0.5;
  vec3 n = normalize(normal + 0.30 * bend);
  vec3 albedo = mix(vec3(0.62, 0.145, 0.115), vec3(0.74, 0.27, 0.21), clamp(0.5 + 1.6 * bend.x, 0.0, 1.0));
  albedo = mix(albedo, vec3(0.33, 0.02, 0.025), 0.55 * vessel);
  fragment = vec4(ToneMap(ShadeTissue(albedo, vec3(0.30, 0.10, 0.08), n, position, 0.75)), 1.0);
}
