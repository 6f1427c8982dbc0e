// Lips and strands of a cut (geometry/cut_lip.h, cut_strands.h), coloured by the history of the tissue as the sheet:
// pale where protein has coagulated, tan to brown towards the cut, black where it is charred. coordinate: material
// (s, t) [m], part (0 upper side, 1 wall of the cut, 2 underside, 3 strand), opacity.
in vec3 position;
in vec3 normal;
in vec4 coordinate;
uniform sampler2D atlas;
uniform sampler2D serosa_pattern;
uniform vec2 atlas_per_metre;
uniform float colour_by_temperature;
out vec4 fragment;

void main() {
  vec2 m = coordinate.xy;
  vec4 heat = texture(atlas, m * atlas_per_metre);
  vec4 liquid = texture(film_map, m * film_per_metre);
  vec4 noise = texture(serosa_pattern, m * 115.0);
  bool strand = coordinate.z > 2.5;
  bool upper = coordinate.z < 0.5;
  bool wall = !upper && coordinate.z < 1.5;
  float damage = heat.g;
  float dry = clamp(2.0 * heat.b, 0.0, 1.0);
  float burnt = clamp(2.0 * heat.b - 1.0, 0.0, 1.0);

  vec4 broad = texture(serosa_pattern, m * 31.0);
  // In the paper's model by the present temperature, as the sheet is.
  float hot = colour_by_temperature * clamp((127.5 * heat.r - 25.0) / 55.0, 0.0, 1.0);
  vec3 albedo = upper ? vec3(0.85, 0.62, 0.49) : wall ? vec3(0.66, 0.36, 0.26) : vec3(0.70, 0.46, 0.35);
  if (strand) albedo = vec3(0.88, 0.70, 0.55);
  albedo *= 0.70 + 0.3 * noise.r + 0.3 * broad.b;
  // Towards the cut, as far as heat has reached: tan, brown where dry, black where charred, all in patches.
  float patches = broad.g + 0.5 * noise.g - 0.75;
  float tan = smoothstep(0.45, 1.15, damage + 0.7 * patches) * (upper ? 0.75 : strand ? 0.3 : 0.45);
  float brown = smoothstep(0.10, 0.75, dry + 0.9 * patches) * (strand ? 0.3 : 0.9);
  albedo = mix(albedo, vec3(0.52, 0.29, 0.14), tan);
  albedo = mix(albedo, vec3(0.20, 0.075, 0.025) * (0.5 + noise.b), brown);
  albedo = mix(albedo, vec3(0.035, 0.022, 0.015), smoothstep(0.05, 0.6, burnt + 0.3 * patches * step(0.01, burnt)));

  albedo = mix(albedo, vec3(0.22, 0.075, 0.022), hot);
  float blood = upper || wall ? 2.0 * liquid.r : 0.6 * liquid.r;
  float bloody = smoothstep(0.0, 0.35, blood);
  albedo = mix(ThroughBlood(albedo, blood), kClot * (0.5 + noise.b), 0.85 * bloody * ClotShare(liquid));
  vec3 bend = noise.rgb - 0.5;
  vec3 n = normalize(normal + (strand ? 0.0 : 0.25) * bend);
  vec3 film = normalize(normal + (strand ? 0.1 : 0.5) * bend);
  float wet = mix((upper ? 1.0 : 0.6) * (1.0 - 0.9 * brown), 1.6, bloody);
  float gloss;
  vec3 shaded = ShadeTissue(tissue_tint * albedo, vec3(0.32, 0.20, 0.13), n, film, position, wet, gloss);
  // The flat part fades into the sheet with an uneven border.
  float alpha = upper || wall ? smoothstep(0.2, 0.8, coordinate.w + 0.8 * coordinate.w * (1.0 - coordinate.w) * patches)
                              : coordinate.w;
  fragment = vec4(ToneMap(shaded), alpha * min(1.0 + 0.5 * gloss, 1.0 / max(alpha, 1e-3)));
}
