// The peritoneum: a thin glossy sheet with faint vessels, through which fat and organ are seen. Its colour follows the
// history of the tissue (damage, water, char), not the temperature of the moment: burns stay.
// coordinate: material (s, t) [m], side (see geometry/membrane_mesh.h).
in vec3 position;
in vec3 normal;
in vec4 coordinate;
uniform sampler2D atlas;
uniform sampler2D noise_pattern;
uniform sampler2D vessel_pattern;
uniform vec2 atlas_per_metre;
out vec4 fragment;

void main() {
  vec2 m = coordinate.xy;
  vec4 heat = texture(atlas, m * atlas_per_metre);
  if (coordinate.z < 0.0 || heat.a < 0.5) discard;
  vec4 noise = texture(noise_pattern, m * 22.0);
  float vessel = texture(vessel_pattern, m * 17.0).r;
  float celsius = 20.0 + 127.5 * heat.r;
  float damage = heat.g;
  float dry = clamp(2.0 * heat.b, 0.0, 1.0);
  float burnt = clamp(2.0 * heat.b - 1.0, 0.0, 1.0);

  vec3 n = normalize(normal + 0.20 * (noise.rgb - 0.5));
  float facing = abs(dot(n, normalize(position)));
  vec3 albedo = mix(vec3(0.80, 0.42, 0.30), vec3(0.86, 0.54, 0.38), noise.g);
  float alpha = 0.26 + 0.12 * noise.r + 0.45 * (1.0 - facing) * (1.0 - facing);

  float living = 1.0 - smoothstep(0.05, 0.5, damage);
  // Warm tissue reddens, then pales as its protein coagulates (from about 60 degrees).
  albedo = mix(albedo, vec3(0.72, 0.20, 0.16), 0.5 * living * smoothstep(41.0, 50.0, celsius));
  albedo = mix(albedo, vec3(0.52, 0.05, 0.05), 0.75 * vessel * living);
  alpha = mix(alpha, max(alpha, 0.62), vessel * living);
  float pale = max(smoothstep(0.05, 0.55, damage), smoothstep(58.0, 75.0, celsius));
  albedo = mix(albedo, vec3(0.90, 0.83, 0.70), pale);
  alpha = mix(alpha, 0.86, pale);
  float brown = smoothstep(0.10, 0.75, dry);
  albedo = mix(albedo, vec3(0.26, 0.095, 0.028) * (0.6 + 0.8 * noise.b), brown);
  alpha = mix(alpha, 0.97, brown);
  albedo = mix(albedo, vec3(0.018, 0.013, 0.010), smoothstep(0.05, 0.6, burnt));

  float wet = 1.0 - 0.9 * max(brown, 0.4 * pale);
  fragment = vec4(ToneMap(ShadeTissue(albedo, vec3(0.30, 0.18, 0.12), n, position, wet)), alpha);
}
