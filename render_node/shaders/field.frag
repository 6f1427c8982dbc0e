// Puts the scene, drawn with fewer pixels, into the picture.
#version 130

in vec2 place;
uniform sampler2D scene_picture;
uniform vec2 texture_most;
uniform vec3 smoke; // Lit smoke in the cavity, and below its share.
uniform float haze;
out vec4 fragment;

void main() { fragment = vec4(mix(texture(scene_picture, min(place, texture_most)).rgb, smoke, haze), 1.0); }
