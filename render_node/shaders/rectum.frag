// A solid's surface: serosa with longitudinal muscle and small vessels, in the colours of the solid. coordinate: place
// at rest along the solid's axis and in both directions across it [m], and share of the normal along the third axis.
in vec3 position;
in vec3 normal;
in vec4 coordinate;
uniform sampler2D serosa_pattern;
uniform vec3 dark, light, vessel_colour;
uniform float vessel_share, pattern_scale, wetness;
out vec4 fragment;

void main() {
  vec2 front = coordinate.xy, side = coordinate.xz;
  float facing = coordinate.w;
  vec4 noise = texture(serosa_pattern, mix(side, front, step(0.5, facing)) * pattern_scale);
  float vessel = noise.a;
  vec3 bend = noise.rgb - 0.5;
  vec3 n = normalize(normal + 0.25 * bend);
  vec3 film = normalize(normal + 0.70 * bend);
  vec3 albedo = mix(dark, light, clamp(0.5 + 1.8 * bend.x, 0.0, 1.0));
  albedo = mix(albedo, vessel_colour, vessel_share * vessel);
  float gloss;
  fragment = vec4(ToneMap(ShadeTissue(tissue_tint * albedo, vec3(0.32, 0.08, 0.07), n, film, position, wetness, gloss)), 1.0);
}
