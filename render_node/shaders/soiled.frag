// As field.frag, through a soiled lens. A program of its own: a software rasteriser runs both sides of a branch.
#version 130

in vec2 place;
uniform sampler2D scene_picture;
uniform vec2 texture_most;
uniform float soil;  // above 0 ... 1 nothing to be seen
uniform vec3 smoke;
uniform float haze;
out vec4 fragment;

const float kReach = 0.035;  // Of the blur, as a share of the picture.
const vec3 kScattered = vec3(0.72, 0.67, 0.65);

vec4 seen(vec2 at) { return texture(scene_picture, clamp(at, vec2(0), texture_most)); }

void main() {
  fragment = seen(place);
  vec2 x = vec2(kReach * soil, 0), y = x.yx;
  vec4 around = seen(place + x) + seen(place - x) + seen(place + y) + seen(place - y) + seen(place + 0.6 * (x + y)) +
                seen(place - 0.6 * (x + y)) + seen(place + 0.6 * (x - y)) + seen(place - 0.6 * (x - y));
  fragment.rgb = mix(mix((fragment + around).rgb / 9.0, smoke, haze), kScattered, 0.6 * soil);
}
