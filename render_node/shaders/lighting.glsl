// Lighting functions shared by all fragment shaders; MakeProgram() prepends this file. View frame: the camera at the
// origin, looking along -z, metres. Colours are linear until ToneMap.
#version 130

uniform vec3 light_position;
uniform vec3 light_axis;
uniform vec3 wall_direction; // Towards the lit wall above, which wet tissue reflects.
uniform float light_power;   // Irradiance at 1 m; falls off with the square of the distance.
uniform vec3 light_colour;   // Of all light that the camera gets: its white and its exposure.
uniform vec3 tissue_tint;    // Of the light that tissue returns.
uniform vec2 circle_radius;  // Of the round picture, across and up [pixels]: stereo squeezes it.
uniform vec2 picture_centre; // [pixels]
uniform vec2 half_height;    // Half of the picture's height, in pixels across and up.

// The scope's light: cone with a soft rim, inverse square.
float Irradiance(vec3 position, out vec3 to_light) {
  vec3 d = light_position - position;
  float inverse = inversesqrt(dot(d, d));
  to_light = d * inverse;
  float cone = smoothstep(0.55, 0.93, -dot(to_light, light_axis));
  return light_power * inverse * inverse * (0.15 + 0.85 * cone);
}

// Specular highlight: a broad lobe and, as its eighth power, a sharp one. exp2 is cheaper than pow on a software
// rasteriser.
float Highlight(float cosine, float broad, float sharp) {
  float lobe = exp2(42.0 * (cosine - 1.0));
  float lobe2 = lobe * lobe, lobe4 = lobe2 * lobe2;
  return broad * lobe + sharp * lobe4 * lobe4;
}

// Tissue: light extends beyond the terminator by subsurface scattering, red farthest. A film of fluid lies on top:
// `film` is its normal, rougher than the tissue's, `wet` its amount. `gloss` is the light that the film reflects.
vec3 ShadeTissue(vec3 albedo, vec3 scatter, vec3 normal, vec3 film, vec3 position, float wet, out float gloss) {
  vec3 l;
  float e = Irradiance(position, l);
  vec3 v = normalize(-position);
  float side = sign(dot(normal, v));
  vec3 diffuse = clamp((side * dot(normal, l) + scatter) / (1.0 + scatter), 0.0, 1.0);
  // Light and eye are only 4 mm apart, so the light's direction is used as the half vector.
  gloss = e * wet * (Highlight(side * dot(film, l), 0.16, 2.4) +
                     Highlight(side * dot(film, normalize(wall_direction + v)), 0.07, 0.45));
  // Indirect light from the rest of the cavity is red.
  return e * (albedo * diffuse) + gloss * vec3(1.0, 0.96, 0.92) + albedo * vec3(0.030, 0.014, 0.012);
}

// What lies around the sheet. fat: its share; noise: a sample of the serosa's pattern.
vec3 AroundTheSheet(vec3 colour, float fat, vec4 noise) {
  return mix(colour * (0.6 + 0.8 * noise.r), vec3(0.80, 0.46, 0.16), fat * smoothstep(0.35, 0.95, noise.g));
}

// The film on the sheet (geometry/atlas.h): thickness of blood and clot, nearness of removed tissue, clot, water. Blood
// of 0.3 mm has the thickness 1 here: 7.6 lengths of absorption of green light, as haemoglobin of 150 g/l has.
uniform sampler2D film_map;
uniform vec2 film_per_metre; // Coordinates of film_map per metre of material.
const float kLipNearness = 0.55; // Where lips begin (geometry/cut_lip.h).

// Tissue seen through a film of blood, by Beer and Lambert: haemoglobin absorbs blue and green long before red, so thin
// blood is bright and thick blood dark. Blood scatters a little light itself.
vec3 ThroughBlood(vec3 albedo, float thickness) {
  vec3 passed = exp2(-thickness * vec3(3.0, 11.0, 12.0));
  return albedo * passed + (1.0 - passed.g) * vec3(0.060, 0.004, 0.004);
}

// Share of a clot in a sample of the film map, for its colour.
const vec3 kClot = vec3(0.050, 0.006, 0.007);
float ClotShare(vec4 film) { return smoothstep(0.15, 0.9, film.b / (film.r + 0.02)); }

// Metal: it reflects the lit cavity, red below and dark towards the scope.
vec3 ShadeMetal(vec3 tint, vec3 normal, vec3 position) {
  vec3 l;
  float e = Irradiance(position, l);
  vec3 v = normalize(-position);
  vec3 n = dot(normal, v) < 0.0 ? -normal : normal;
  vec3 r = reflect(-v, n);
  vec3 cavity = mix(vec3(0.42, 0.17, 0.13), vec3(0.03, 0.025, 0.025), smoothstep(-0.7, 0.35, r.z));
  float nl = max(dot(n, l), 0.0);
  return tint * (e * (0.10 * nl + Highlight(nl, 0.7, 2.2)) + (0.35 + 0.65 * e) * cavity);
}

// Tone curve 1 - 1 / (1 + x)^2, gamma of 2, and vignetting towards the rim of the optics.
vec3 ToneMap(vec3 colour) {
  vec2 r = (gl_FragCoord.xy - picture_centre) / circle_radius;
  float r2 = dot(r, r);
  vec3 y = 1.0 / (1.0 + (0.95 - 0.55 * r2 * r2) * light_colour * colour);
  return sqrt(1.0 - y * y);
}
