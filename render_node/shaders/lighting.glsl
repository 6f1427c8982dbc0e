// Shared by every fragment shader; the build puts it in front of them. View frame: the camera at the origin, looking
// along -z, metres. Colours are linear until ToneMap.
#version 130

uniform vec3 light_position;
uniform vec3 light_axis;
uniform float light_power;   // Irradiance at 1 m; falls off with the square of the distance.
uniform float circle_radius; // Of the round picture [pixels].
uniform vec2 picture_centre; // [pixels]

// Cosine-like lobe of the given sharpness around 1; exp2 costs a software rasteriser less than pow.
float Lobe(float cosine, float sharpness) { return exp2(sharpness * (cosine - 1.0)); }

// The scope's light: cone with a soft rim, inverse square.
float Irradiance(vec3 position, out vec3 to_light) {
  vec3 d = light_position - position;
  float inverse = inversesqrt(dot(d, d));
  to_light = d * inverse;
  float cone = smoothstep(0.55, 0.93, -dot(to_light, light_axis));
  return light_power * inverse * inverse * (0.15 + 0.85 * cone);
}

// Tissue: light wraps round the terminator, red furthest (it scatters deepest); `wet` is the film of fluid on top.
vec3 ShadeTissue(vec3 albedo, vec3 scatter, vec3 normal, vec3 position, float wet) {
  vec3 l;
  float e = Irradiance(position, l);
  vec3 v = normalize(-position);
  vec3 n = dot(normal, v) < 0.0 ? -normal : normal;
  vec3 diffuse = clamp((dot(n, l) + scatter) / (1.0 + scatter), 0.0, 1.0);
  float nh = dot(n, normalize(l + v));
  float rim = 1.0 - max(dot(n, v), 0.0);
  float gloss = wet * (1.1 * Lobe(nh, 420.0) + 0.16 * Lobe(nh, 45.0) + 0.05 * rim * rim * rim);
  return e * (albedo * diffuse + gloss * vec3(1.0, 0.97, 0.94)) + 0.012 * albedo;
}

// Metal: what it mirrors is the lit cavity, red below and dark towards the scope.
vec3 ShadeMetal(vec3 tint, vec3 normal, vec3 position) {
  vec3 l;
  float e = Irradiance(position, l);
  vec3 v = normalize(-position);
  vec3 n = dot(normal, v) < 0.0 ? -normal : normal;
  vec3 r = reflect(-v, n);
  vec3 cavity = mix(vec3(0.30, 0.10, 0.08), vec3(0.05, 0.04, 0.04), smoothstep(-0.4, 0.5, r.z));
  float nh = dot(n, normalize(l + v));
  return e * tint * (0.35 * max(dot(n, l), 0.0) + 1.5 * Lobe(nh, 160.0) + 0.35 * Lobe(nh, 14.0)) + tint * cavity;
}

// Filmic shoulder, gamma of two, and the darkening towards the rim of the optics.
vec3 ToneMap(vec3 colour) {
  float r = length(gl_FragCoord.xy - picture_centre) / circle_radius;
  float vignette = 1.0 - 0.45 * r * r * r;
  return sqrt(1.0 - exp2(-1.7 * vignette * colour));
}
