// As field.frag where the scene has up to four by four texels a pixel: the mean of four samples, each of which the sampler
// takes from four texels. A program of its own: a software rasteriser would pay for it at every scale.
#version 130

in vec2 place;
uniform sampler2D scene_picture;
uniform vec2 texture_most;
uniform vec2 pixel;  // as a share of the texture
uniform vec3 smoke;
uniform float haze;
out vec4 fragment;

vec4 seen(vec2 at) { return texture(scene_picture, min(at, texture_most)); }

void main() {
  vec2 a = 0.25 * pixel, b = vec2(a.x, -a.y);
  fragment = 0.25 * (seen(place + a) + seen(place - a) + seen(place + b) + seen(place - b));
  fragment.rgb = mix(fragment.rgb, smoke, haze);
}
