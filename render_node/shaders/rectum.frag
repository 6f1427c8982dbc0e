// The organ's serosa: wet pink-red with longitudinal muscle and small vessels. coordinate: place at rest along the
// organ's axis and in both directions across it [m], and share of the normal along the third axis.
in vec3 position;
in vec3 normal;
in vec4 coordinate;
uniform sampler2D serosa_pattern;
out vec4 fragment;

void main() {
  vec2 front = coordinate.xy, side = coordinate.xz;
  float facing = coordinate.w;
  vec4 noise = texture(serosa_pattern, mix(side, front, step(0.5, facing)) * 20.0);
  float vessel = noise.a;
  vec3 bend = noise.rgb - 0.5;
  vec3 n = normalize(normal + 0.25 * bend);
  vec3 film = normalize(normal + 0.70 * bend);
  vec3 albedo = mix(vec3(0.52, 0.070, 0.060), vec3(0.72, 0.20, 0.15), clamp(0.5 + 1.8 * bend.x, 0.0, 1.0));
  albedo = mix(albedo, vec3(0.26, 0.008, 0.014), 0.5 * vessel);
  float gloss;
  fragment = vec4(ToneMap(ShadeTissue(tissue_tint * albedo, vec3(0.32, 0.08, 0.07), n, film, position, 0.8, gloss)), 1.0);
}
