// Puts the scene, drawn with fewer pixels, into the picture.
#version 130

in vec2 place;
uniform sampler2D scene_picture;
uniform vec2 texture_most;
out vec4 fragment;

void main() { fragment = texture(scene_picture, min(place, texture_most)); }
