// Loose fat between membrane and organ, a thin veil over the organ's front and thick beside it, with ureter and nerve
// shining through. Where it is bared: yellow lobules with vessels in their clefts and a film of areolar tissue over
// them. Beneath the intact membrane, which blurs what lies below, only a pale tint is left of them; BENEATH draws
// nothing else. coordinate: material (s, t) [m], thickness 0 … 1 or, towards a rim that is fused with the organ,
// negative, bared share 0 … 1.
in vec3 position;
in vec3 normal;
in vec4 coordinate;
uniform sampler2D noise_pattern;
uniform sampler2D structures;
uniform vec2 atlas_per_metre;  // Atlas coordinates per metre of material.
#ifndef BENEATH
uniform sampler2D atlas;
uniform sampler2D fat_pattern; // MakeFatPattern.
#endif
out vec4 fragment;

const vec3 kScatter = vec3(0.35, 0.25, 0.12);

void main() {
  vec2 m = coordinate.xy;
  vec4 broad = texture(noise_pattern, m * 9.0);
  vec2 structure = texture(structures, m * atlas_per_metre).rg;
  vec3 bend = 0.22 * (broad.rgb - 0.5);
  vec3 albedo = vec3(0.82, 0.52, 0.24);
  // Islands where the layer is thin, continuous where it is thick.
  float alpha = 0.40 * smoothstep(0.51, 0.80, broad.r * 0.8 + 0.45 * coordinate.z);
  vec3 n = normal, film = normal + bend;
  float wet = 0.4;

#ifndef BENEATH
  // The coarse noise distorts the coordinates of the lobules, so that no two are alike.
  vec4 fat = texture(fat_pattern, m * 36.0 + 0.35 * broad.rg);
  vec4 heat = texture(atlas, m * atlas_per_metre);
  vec4 liquid = texture(film_map, m * film_per_metre);
  float blood = 2.0 * liquid.r;
  float opened = max(heat.a < 0.5 ? 1.0 : 0.0, smoothstep(0.2, 0.8, coordinate.w));

  // Directions of s and t on the surface, for the slope of the lobules. Where it is seen edge on they cannot be found.
  vec3 px = dFdx(position), py = dFdy(position);
  vec2 mx = dFdx(m), my = dFdy(m);
  float pixel = mx.x * my.y - mx.y * my.x;
  float inverse = abs(pixel) > 1e-13 ? 1.0 / pixel : 0.0;
  vec2 slope = 4.0 * (fat.rg - 0.502) * (1.0 - 0.6 * smoothstep(0.1, 0.6, blood)); // Blood fills the clefts.
  vec3 relief = inverse * (slope.x * (my.y * px - mx.y * py) + slope.y * (mx.x * py - my.x * px));
  relief *= opened * min(1.0, 1.5 * inversesqrt(dot(relief, relief) + 1e-12));
  n = normal - 0.75 * relief;
  film -= 0.9 * relief;

  float tone = clamp(2.0 * fat.a - 0.75 + 0.9 * (broad.b - 0.5), 0.0, 1.0);
  vec3 lobule = mix(vec3(0.70, 0.31, 0.045), vec3(0.84, 0.52, 0.12), tone);
  float cleft = 1.0 - smoothstep(0.05, 0.65, fat.b);
  lobule = mix(lobule, vec3(0.55, 0.13, 0.05), 0.70 * cleft) * (1.0 - 0.45 * cleft * cleft);
  lobule = mix(lobule, vec3(0.40, 0.035, 0.025), 0.8 * smoothstep(0.50, 0.25, fat.a));
  // The areolar film, thicker in places.
  lobule = mix(lobule, vec3(0.80, 0.58, 0.38), 0.05 + 0.30 * smoothstep(0.45, 0.75, broad.g));
  albedo = mix(albedo, lobule, opened);
  alpha = mix(alpha, 0.97, opened);
  wet += 1.2 * opened;
#endif

  // A ureter is a pale pink cord, a nerve a thin white one.
  float cord = smoothstep(0.35, 0.65, structure.r);
  float nerve = smoothstep(0.40, 0.70, structure.g);
  albedo = mix(albedo, vec3(0.86, 0.46, 0.40) * (0.62 + 0.6 * structure.r), 0.85 * cord);
  albedo = mix(albedo, vec3(0.92, 0.82, 0.58), 0.80 * nerve);
  alpha = max(alpha, 0.9 * max(cord, nerve));

#ifndef BENEATH
  // Under a burn the fat is seared as well, least in the open middle of the slit.
  float dry = clamp(2.0 * heat.b, 0.0, 1.0);
  albedo *= mix(vec3(1.0), vec3(0.62, 0.42, 0.28), (heat.a < 0.5 ? 0.35 : 0.7) * dry);
  albedo = mix(ThroughBlood(albedo, blood), kClot, 0.85 * ClotShare(liquid));
  alpha = mix(alpha, 0.97, smoothstep(0.0, 0.3, blood));
#endif
  float gloss;
  vec3 shaded = ShadeTissue(tissue_tint * albedo, kScatter, normalize(n), normalize(film), position, wet, gloss);
  fragment = vec4(ToneMap(shaded), alpha);
}
