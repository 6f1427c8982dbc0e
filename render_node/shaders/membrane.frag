// The peritoneum: a thin glossy sheet with faint vessels, through which fat and organ are seen. Its colour follows the
// history of the tissue (damage, water, char) more than the temperature of the moment: burns stay.
// coordinate: material (s, t) [m], side (see geometry/membrane_mesh.h).
in vec3 position;
in vec3 normal;
in vec4 coordinate;
uniform sampler2D atlas;
uniform sampler2D serosa_pattern;
uniform vec2 atlas_per_metre;
uniform float colour_by_temperature; // 1: the paper's eq. 15, from the temperature of the moment.
out vec4 fragment;

void main() {
  vec2 m = coordinate.xy;
  vec4 heat = texture(atlas, m * atlas_per_metre);
  if (coordinate.z < 0.0 || heat.a < 0.5) discard;
  vec4 noise = texture(serosa_pattern, m * 16.0);
  float vessel = noise.a;
  float celsius = 20.0 + 127.5 * heat.r;
  float damage = heat.g;
  float dry = clamp(2.0 * heat.b, 0.0, 1.0);
  float burnt = clamp(2.0 * heat.b - 1.0, 0.0, 1.0);

  vec3 bend = noise.rgb - 0.5;
  vec3 n = normalize(normal + 0.12 * bend);
  vec3 film = normalize(normal + 0.42 * bend);
  float facing = abs(dot(n, normalize(position)));
  float grazing = (1.0 - facing) * (1.0 - facing);
  vec3 albedo = mix(vec3(0.84, 0.40, 0.30), vec3(0.90, 0.60, 0.45), noise.g);
  float alpha = 0.27 + 0.22 * noise.r + 0.45 * grazing;

  float living = 1.0 - smoothstep(0.05, 0.5, damage);
  // Warm tissue reddens, then pales as its protein coagulates (from about 60 degrees).
  albedo = mix(albedo, vec3(0.72, 0.16, 0.13), 0.5 * living * smoothstep(41.0, 50.0, celsius));
  albedo = mix(albedo, vec3(0.46, 0.03, 0.03), 0.8 * vessel * living);
  alpha = mix(alpha, max(alpha, 0.60), vessel * living);
  float pale = max(smoothstep(0.05, 0.55, damage), smoothstep(58.0, 75.0, celsius));
  albedo = mix(albedo, vec3(0.92, 0.82, 0.66), pale);
  alpha = mix(alpha, 0.80, pale);
  // Coagulated through and through it turns tan, dry it turns brown, charred it turns black.
  albedo = mix(albedo, vec3(0.46, 0.22, 0.08), 0.9 * smoothstep(0.3, 0.8, damage));
  float brown = smoothstep(0.02, 0.4, dry);
  albedo = mix(albedo, vec3(0.22, 0.075, 0.022) * (0.5 + noise.b), brown);
  alpha = mix(alpha, 0.97, brown);
  albedo = mix(albedo, vec3(0.035, 0.022, 0.015), smoothstep(0.05, 0.6, burnt));

  float hot = colour_by_temperature * clamp((celsius - 45.0) / 55.0, 0.0, 1.0);
  albedo = mix(albedo, vec3(0.22, 0.075, 0.022), hot);
  alpha = mix(alpha, 0.95, hot);
  // Blood lies on top: the low bits of the fourth channel (geometry/atlas.h).
  // Where the atlas is neither whole nor clean, of the texel itself: half way to an open one would look like blood.
  float own = heat.a < 0.97 ? texelFetch(atlas, ivec2(m * atlas_per_metre * vec2(textureSize(atlas, 0))), 0).a : 1.0;
  float blood = own < 0.5 ? 0.0 : smoothstep(0.12, 0.7, 2.0 - 2.0 * own);
  albedo = mix(albedo, vec3(0.30, 0.006, 0.008), 0.95 * blood);
  alpha = mix(alpha, 0.96, blood);

  float wet = 1.6 * (1.0 - 0.92 * max(brown, 0.3 * pale));
  // What glitters is not see-through.
  float gloss;
  vec3 shaded = ShadeTissue(albedo, vec3(0.30, 0.16, 0.10), n, film, position, wet, gloss);
  fragment = vec4(ToneMap(shaded), min(alpha + 0.8 * gloss, 1.0));
}
