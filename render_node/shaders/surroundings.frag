// Surfaces that do not move: abdominal wall, retroperitoneum, pelvis, bladder. colour: of the material.
// coordinate: place in frame W [m].
in vec3 position;
in vec3 normal;
in vec4 colour;
in vec4 coordinate;
uniform sampler2D noise_pattern;
uniform sampler2D vessel_pattern;
out vec4 fragment;

void main() {
  // A slanted projection: no plane of the body is seen edge on by it for long.
  vec2 place = vec2(coordinate.x + 0.41 * coordinate.z, coordinate.y - 0.57 * coordinate.z);
  vec4 noise = texture(noise_pattern, place * 13.0);
  float vessel = texture(vessel_pattern, place * 11.0).r;
  vec3 bend = noise.rgb - 0.5;
  vec3 n = normalize(normal + 0.35 * bend);
  vec3 albedo = colour.rgb * (1.0 + 0.9 * bend.x);
  albedo = mix(albedo, vec3(0.70, 0.42, 0.16), 0.35 * colour.a * smoothstep(0.4, 0.9, noise.a));
  albedo = mix(albedo, vec3(0.36, 0.03, 0.03), 0.5 * vessel);
  fragment = vec4(ToneMap(ShadeTissue(albedo, vec3(0.25, 0.12, 0.10), n, position, 0.6)), 1.0);
}
