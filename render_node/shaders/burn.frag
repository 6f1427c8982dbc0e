// Burns of a solid, laid over its own surface (rectum.frag). The colours are those of burnt peritoneum (membrane.frag);
// what has vaporised is a shallow charred pit. coordinate: material (s, t) in the charts [m]; the number of the
// chart, the third, is for the ground truth. colour: lowest and highest (s, t) of the corner's chart.
in vec3 position;
in vec3 normal;
in vec4 colour;
in vec4 coordinate;
uniform sampler2D serosa_pattern;
uniform sampler2D burn_atlas;
uniform vec2 burn_per_metre; // Atlas coordinates per metre of material.
out vec4 fragment;

const float kTexel = 2e-4; // [m]
const float kPit = 4e-4;   // Depth of a pit [m], that of the layer which vaporises.

float Alive(vec2 m) { return texture(burn_atlas, m * burn_per_metre).a; }

void main() {
  vec2 m = coordinate.xy;
  // Before any branch, which derivatives require.
  vec3 px = dFdx(position), py = dFdy(position);
  vec2 mx = dFdx(m), my = dFdy(m);
  vec4 noise = texture(serosa_pattern, m * 16.0);
  vec4 heat = texture(burn_atlas, m * burn_per_metre);
  // Most of a chart is intact. Beyond its box lies another chart, with triangles of its own here.
  bool beyond = any(lessThan(m, colour.xy)) || any(greaterThan(m, colour.zw));
  if (beyond || (max(heat.g, heat.b) < 0.008 && heat.a > 0.99)) discard;

  vec3 bend = noise.rgb - 0.5;
  float damage = heat.g * (0.85 + 0.3 * noise.g); // So that a border is ragged.
  float dry = clamp(2.0 * heat.b, 0.0, 1.0);
  float burnt = clamp(2.0 * heat.b - 1.0, 0.0, 1.0);
  float pale = smoothstep(0.05, 0.55, damage);
  float brown = smoothstep(0.02, 0.4, dry);
  float charred = smoothstep(0.05, 0.6, burnt);

  // Damage pales, then tans; dry tissue is brown, charred tissue black.
  vec3 albedo = mix(vec3(0.92, 0.82, 0.66), vec3(0.46, 0.22, 0.08), 0.9 * smoothstep(0.3, 0.8, damage));
  albedo = mix(albedo, vec3(0.22, 0.075, 0.022) * (0.5 + noise.b), brown);
  albedo = mix(albedo, vec3(0.035, 0.022, 0.015), charred);
  float alpha = mix(0.80 * pale, 0.97, brown);

  // A pit: its walls follow from the texels beside it.
  float east = Alive(m + vec2(1.5 * kTexel, 0.0)), west = Alive(m - vec2(1.5 * kTexel, 0.0));
  float north = Alive(m + vec2(0.0, 1.5 * kTexel)), south = Alive(m - vec2(0.0, 1.5 * kTexel));
  float around = 0.25 * (east + west + north + south);
  float pit = 1.0 - smoothstep(0.3, 0.7, heat.a);
  float rim = smoothstep(0.02, 0.4, 1.0 - around) * (1.0 - pit) * (1.0 - 0.7 * charred);
  albedo = mix(albedo, vec3(0.80, 0.62, 0.42), 0.55 * rim);
  albedo = mix(albedo, vec3(0.050, 0.027, 0.016) * (0.4 + 1.2 * noise.b), pit);
  alpha = mix(alpha, 0.98, pit);
  if (alpha < 0.01) discard;

  // Directions of s and t on the surface, for the slope of the pit. Where it is seen edge on they cannot be found.
  float pixel = mx.x * my.y - mx.y * my.x;
  float known = step(1e-13, abs(pixel));
  vec3 along_s = (my.y * px - mx.y * py) / (known > 0.5 ? pixel : 1.0);
  vec3 along_t = (mx.x * py - my.x * px) / (known > 0.5 ? pixel : 1.0);
  vec2 slope = known * kPit / (3.0 * kTexel) * vec2(east - west, north - south);
  vec3 relief = normal + 0.25 * bend - slope.x * along_s - slope.y * along_t;
  float rough = mix(0.70, 1.20, max(pit, charred));
  vec3 n = normalize(relief + 0.35 * max(pit, charred) * bend);
  vec3 film = normalize(relief + rough * bend);
  // Coagulated tissue is less wet than healthy tissue; dry tissue is dull.
  float wet = 0.9 * (1.0 - 0.5 * pale) * (1.0 - 0.95 * max(brown, pit));
  float gloss;
  vec3 shaded = ShadeTissue(tissue_tint * albedo, vec3(0.30, 0.16, 0.10), n, film, position, wet, gloss);
  fragment = vec4(ToneMap(shaded), min(alpha * (1.0 + 0.8 * gloss), 1.0));
}
