#version 130

in vec2 place;
in vec4 colour;
uniform sampler2D glyphs;
out vec4 fragment;

// The cell of a glyph darkens the picture, so that grey text is legible over pale tissue.
const float cell = 0.5;

void main() {
  float glyph = texture(glyphs, place).r;
  float cover = mix(cell, 1.0, glyph);
  fragment = vec4(colour.rgb * glyph / cover, cover);
}
