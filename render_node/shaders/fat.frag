// Loose fat between membrane and organ: yellow lobules, thin in the clefts, with ureter and nerve shining through.
// coordinate: material (s, t) [m].
in vec3 position;
in vec3 normal;
in vec4 coordinate;
uniform sampler2D noise_pattern;
uniform sampler2D atlas;
uniform sampler2D structures;
uniform vec2 atlas_per_metre;  // Atlas coordinates per metre of material.
out vec4 fragment;

void main() {
  vec2 m = coordinate.xy;
  vec4 noise = texture(noise_pattern, m * 34.0);
  vec4 heat = texture(atlas, m * atlas_per_metre);
  vec2 structure = texture(structures, m * atlas_per_metre).rg;
  vec3 bend = noise.rgb - 0.5;
  float lobule = noise.a;
  vec3 n = normalize(normal + 0.55 * bend);
  vec3 albedo = mix(vec3(0.60, 0.27, 0.085), vec3(0.86, 0.56, 0.155), lobule);
  // A ureter is a pale pink cord, a nerve a thin white one.
  float cord = smoothstep(0.35, 0.65, structure.r);
  float nerve = smoothstep(0.40, 0.70, structure.g);
  albedo = mix(albedo, vec3(0.86, 0.52, 0.45) * (0.72 + 0.5 * structure.r), 0.85 * cord);
  albedo = mix(albedo, vec3(0.92, 0.82, 0.62), 0.80 * nerve);
  // Under a burn the fat is seared too, least in the open middle of the slit.
  float dry = clamp(2.0 * heat.b, 0.0, 1.0);
  albedo *= mix(vec3(1.0), vec3(0.46, 0.27, 0.16), (heat.a < 0.5 ? 0.35 : 0.8) * dry);
  float alpha = clamp(0.42 + 0.42 * lobule + cord + nerve + (heat.a < 0.5 ? 0.25 : 0.0), 0.0, 0.96);
  fragment = vec4(ToneMap(ShadeTissue(albedo, vec3(0.35, 0.25, 0.12), n, position, 0.55)), alpha);
}
