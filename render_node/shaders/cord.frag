// Ureter and nerve where nothing covers them. colour: of the material.
in vec3 position;
in vec3 normal;
in vec4 colour;
out vec4 fragment;

void main() {
  fragment = vec4(ToneMap(ShadeTissue(colour.rgb, vec3(0.3, 0.15, 0.1), normalize(normal), position, 0.7)), 1.0);
}
