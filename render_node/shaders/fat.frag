// Loose fat between membrane and organ: yellow lobules, a thin veil over the organ's front and thick beside it, with
// ureter and nerve shining through. coordinate: material (s, t) [m], thickness 0 … 1 or, towards a rim that is fused with the
// organ, negative, bared share 0 … 1.
in vec3 position;
in vec3 normal;
in vec4 coordinate;
uniform sampler2D noise_pattern;
uniform sampler2D structures;
uniform vec2 atlas_per_metre;  // Atlas coordinates per metre of material.
out vec4 fragment;

const float kRelief = 3e-4; // Height of a lobule over the clefts [m].
const float kSteepest = 1.5;

// Gradient over the surface of a height above it, from its differences between neighbouring pixels.
vec3 Slope(float height, vec3 n) {
  vec3 x = dFdx(position), y = dFdy(position);
  vec3 to_x = cross(y, n), to_y = cross(n, x);
  float area = dot(x, to_x); // Of a pixel on the surface [m^2]; its sign is that of the side that is seen.
  vec3 slope = (dFdx(height) * to_x + dFdy(height) * to_y) * sign(area) / max(abs(area), 1e-30);
  // Limited, because it would become infinite for a surface that is seen edge on.
  return slope * min(1.0, kSteepest * inversesqrt(dot(slope, slope) + 1e-12));
}

void main() {
  vec2 m = coordinate.xy;
  vec4 broad = texture(noise_pattern, m * 9.0);
  // The coarse noise distorts the coordinates of the fine one, so that no two lobules are alike.
  vec4 noise = texture(noise_pattern, m * 36.0 + 0.35 * broad.rg);
  vec4 heat = texture(atlas, m * atlas_per_metre);
  vec2 structure = texture(structures, m * atlas_per_metre).rg;
  vec3 bend = noise.rgb - 0.5;
  float lobule = noise.a;
  vec3 n = normalize(normal - Slope(kRelief * lobule, normal) + 0.35 * bend);
  vec3 albedo = mix(vec3(0.62, 0.29, 0.11), vec3(0.91, 0.60, 0.20), lobule * (0.55 + 0.75 * broad.b));
  // A ureter is a pale pink cord, a nerve a thin white one.
  float cord = smoothstep(0.35, 0.65, structure.r);
  float nerve = smoothstep(0.40, 0.70, structure.g);
  albedo = mix(albedo, vec3(0.86, 0.46, 0.40) * (0.62 + 0.6 * structure.r), 0.85 * cord);
  albedo = mix(albedo, vec3(0.92, 0.82, 0.58), 0.80 * nerve);
  // Islands where the layer is thin, continuous where it is thick; in an open slit it protrudes.
  float cover = smoothstep(0.51, 0.66, broad.r * 0.8 + 0.45 * coordinate.z);
  // The border of bared fat follows the lobules, not a straight line.
  float bared = smoothstep(0.30, 0.75, coordinate.w + 0.7 * (lobule - 0.5) + 1.2 * (broad.g - 0.5));
  float opened = max(heat.a < 0.5 ? 1.0 : 0.0, bared * smoothstep(0.0, 0.35, coordinate.w));
  float alpha = (0.30 + 0.25 * lobule) * cover; // Beneath intact tissue, which blurs what lies below.
  alpha = max(alpha, (0.86 + 0.10 * lobule) * opened);
  alpha = clamp(max(alpha, 0.9 * max(cord, nerve)), 0.0, 0.97);
  // Under a burn the fat is seared as well, least in the open middle of the slit.
  float dry = clamp(2.0 * heat.b, 0.0, 1.0);
  albedo *= mix(vec3(1.0), vec3(0.46, 0.27, 0.16), (heat.a < 0.5 ? 0.25 : 0.7) * dry);
  float blood = heat.a < 0.97 ? BloodAt(m * atlas_per_metre) : 0.0;
  float bloody = smoothstep(0.15, 0.45, blood);
  albedo = mix(albedo, BloodColour(blood), bloody);
  alpha = mix(alpha, 0.97, bloody);
  vec3 film = normalize(mix(n, normal + 0.2 * bend, 0.5 * bloody)); // Blood fills half of a cleft.
  float gloss;
  fragment = vec4(ToneMap(ShadeTissue(tissue_tint * albedo, vec3(0.35, 0.25, 0.12), n, film, position, 0.8 + 0.8 * bloody, gloss)), alpha);
}
