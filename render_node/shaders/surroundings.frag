// Surfaces that do not deform: abdominal wall, retroperitoneum, pelvis, bladder. colour: of the material; alpha is how
// much fat lies beneath. coordinate: place in frame W [m], 1 for the far and matt background.
in vec3 position;
in vec3 normal;
in vec4 colour;
in vec4 coordinate;
uniform sampler2D serosa_pattern;
out vec4 fragment;

void main() {
  // An oblique projection, so that no anatomical plane is seen edge on.
  vec2 place = vec2(coordinate.x + 0.41 * coordinate.z, coordinate.y - 0.57 * coordinate.z) * (1.0 - 0.65 * coordinate.w);
  vec4 noise = texture(serosa_pattern, place * 14.0);
  float vessel = noise.a;
  vec3 bend = noise.rgb - 0.5;
  vec3 n = normalize(normal + 0.15 * bend);
  vec3 film = normalize(normal + 0.5 * bend);
  vec3 albedo = AroundTheSheet(colour.rgb, colour.a, noise);
  albedo = mix(albedo, vec3(0.34, 0.015, 0.02), 0.45 * vessel);
  float gloss;
  fragment = vec4(ToneMap(ShadeTissue(tissue_tint * albedo, vec3(0.28, 0.10, 0.08), n, film, position, 0.7 - 0.68 * coordinate.w, gloss)), 1.0);
}
