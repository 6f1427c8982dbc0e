// What does not deform: abdominal wall, retroperitoneum, pelvis, bladder, the cavity, and decoration: loops of bowel
// and cords of fat. colour: of the material; alpha is how much fat lies beneath, 1: fat itself. coordinate: place for
// the patterns [m], wetness, share of the light that is not kept away by what lies nearby.
in vec3 position;
in vec3 normal;
in vec4 colour;
in vec4 coordinate;
uniform sampler2D serosa_pattern;
uniform sampler2D noise_pattern;
uniform sampler2D fat_pattern; // Height of the lobules in blue.
out vec4 fragment;

void main() {
  vec4 noise = texture(serosa_pattern, coordinate.xy * 14.0);
  // Turned, and of another size: together the two do not repeat.
  vec3 other = texture(noise_pattern, mat2(0.94, 0.34, -0.34, 0.94) * coordinate.xy * 18.7).rgb;
  float cleft = 1.0 - smoothstep(0.05, 0.65, texture(fat_pattern, coordinate.xy * 36.0 + 0.35 * other.rg).b);
  vec3 bend = noise.rgb - 0.5;
  vec3 fine = other - 0.5;
  float soft = max(0.5 * colour.a * smoothstep(0.35, 0.95, noise.g), 4.0 * colour.a - 3.0);
  vec3 n = normalize(normal + 0.15 * bend + 0.35 * soft * fine);
  vec3 film = normalize(normal + 0.3 * bend + 0.35 * fine);
  vec3 albedo = mix(AroundTheSheet(colour.rgb, colour.a, noise), colour.rgb, max(4.0 * colour.a - 3.0, 0.0));
  albedo *= 0.8 + 0.4 * other.r;
  albedo = mix(albedo, vec3(0.34, 0.015, 0.02), (0.45 - 0.2 * soft) * noise.a);
  albedo *= coordinate.w * (1.0 - 0.4 * soft * cleft);
  float gloss;
  vec3 lit = ShadeTissue(tissue_tint * albedo, vec3(0.28, 0.10, 0.08), n, film, position, coordinate.z * coordinate.w,
                         gloss);
  fragment = vec4(ToneMap(lit), 1.0);
}
