// Instruments. colour: linear; alpha: metallic share.
in vec3 position;
in vec3 normal;
in vec4 colour;
out vec4 fragment;

void main() {
  vec3 n = normalize(normal);
  vec3 metal = ShadeMetal(colour.rgb, n, position);
  float gloss;
  vec3 dull = ShadeTissue(colour.rgb, vec3(0.0), n, n, position, 0.25, gloss);
  fragment = vec4(ToneMap(mix(dull, metal, colour.a)), 1.0);
}
