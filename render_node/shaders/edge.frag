// Smooths an edge of known place: the colour is the mean of the colours on its two sides, by the share of the pixel on
// each. They are taken at some distance from the edge, where no pixel of the scene shows both sides. A hidden edge is
// left as it is: the surface that ends there must be seen inside, and nothing nearer outside.
#version 130

in vec2 place;
in vec2 in_field;
in vec4 across;
in vec3 depths;
uniform sampler2D scene_picture;
uniform sampler2D scene_depth;
uniform vec2 texture_most;
uniform vec2 pixel;   // As a share of the texture.
uniform float reach;  // From the edge to where the colours are taken [pixels of the picture].
uniform vec3 smoke;
uniform float haze;
out vec4 fragment;

// Share of a pixel on the inner side of a straight edge (geometry/outline.h).
float Coverage(vec2 normal, float distance) {
  vec2 n = abs(normal);
  float longer = max(n.x, n.y), shorter = min(n.x, n.y), away = abs(distance);
  float corner = max(0.5 * (longer + shorter) - away, 0.0);
  float rest = away <= 0.5 * (longer - shorter) ? 0.5 - away / longer : 0.5 * corner * corner / (longer * shorter);
  return distance > 0.0 ? rest : 1.0 - rest;
}

void main() {
  vec2 normal = across.xy, one = normal * pixel;
  float distance = across.z;
  vec2 inner = clamp(place - one * max(reach + distance, 0.0), vec2(0.0), texture_most);
  vec2 outer = clamp(place + one * max(reach - distance, 0.0), vec2(0.0), texture_most);
  vec3 beyond = vec3(0.0);
  if (across.w < 1.5) {
    vec2 texels = vec2(textureSize(scene_depth, 0));
    float depth = texelFetch(scene_depth, ivec2(inner * texels), 0).r;
    if (depth < depths.x || depth > depths.y || dot(in_field, in_field) > 1.0) discard;
    depth = texelFetch(scene_depth, ivec2(outer * texels), 0).r;
    if (depth < depths.z || (across.w > 0.5 && depth > depths.y)) discard;
    beyond = mix(texture(scene_picture, outer).rgb, smoke, haze);
  }
  vec3 here = mix(texture(scene_picture, inner).rgb, smoke, haze);
  fragment = vec4(mix(beyond, here, Coverage(normal, distance)), 1.0);
}
