// The membrane, a double sheet through which fat and organ are seen: the peritoneum, thin and glossy with faint
// vessels, and the fascia beneath it, of pale fibres. Colours depend on the history of the tissue (damage, water, char)
// more than on the present temperature, so burns persist. One triangle draws both layers: the fascia is sampled where
// the line of sight meets it, and the two are blended here, the nearer one on top. So their order is correct for each
// pixel, for either side of the sheet and any order of triangles. coordinate: material (s, t) [m], side (see
// geometry/membrane_mesh.h), nearness of a rim that fixed tissue continues or, negative, that is fused with the organ.
in vec3 position;
in vec3 normal;
in vec4 coordinate;
uniform sampler2D atlas;
uniform sampler2D serosa_pattern;
uniform vec2 atlas_per_metre;
#ifndef UNTOUCHED // Tissue without history (Atlas::Untouched), most of a sheet, in half the time.
uniform float colour_by_temperature; // 1: the paper's eq. 15, a function of the present temperature.
#endif
#ifdef AS_PRINTED // The paper's eq. 15 to the letter (geometry/paper_colour.h). Apart: a software rasteriser compiles slowly.
uniform vec4 printed_limits;     // T_a and T_vaporization [degree C], v_vaporization, v_brown.
uniform vec4 printed_colours[3]; // C1, C2, C3.
#endif
uniform vec4 around;                 // Colour of the tissue that continues the sheet, and its share of fat.
uniform float fascia_depth;          // Below the peritoneum, along the normal [m].
uniform mat4 osg_ProjectionMatrix;
uniform int planned_points;            // Points of an exercise's planned line; 0: none.
uniform vec2 planned_line[64];         // [m] of the sheet.
uniform vec4 planned_box;              // Bounding box of the line's ink: lowest and highest (s, t).
out vec4 fragment;

#ifdef CLIPS // Scenes with a clip applier.
uniform sampler2D cut_off; // 1 where clips have cut a vessel off from its supply.
uniform int clip_count;
uniform vec4 clip_lines[16]; // Where clips hold the sheet: ends of a line, (s, t) [m] (geometry/clip_footprint.h).
const float kGather = 0.009; // [m] From a clip within which tissue is drawn together.

// Tissue that a clip draws together. away: distance from the nearest line [m]. height: of the folds that run towards it
// [m]; valley: 1 at their bottom. drawn: offset in (s, t) [m] to the place that the pull has brought here. uneven: noise.
void Gathered(vec2 m, float uneven, out float away, out float height, out float valley, out vec2 drawn) {
  away = kGather;
  height = 0.0;
  valley = 0.0;
  drawn = vec2(0.0);
  for (int i = 0; i < clip_count; ++i) {
    vec2 line = clip_lines[i].zw - clip_lines[i].xy;
    float reach = 0.5 * max(length(line), 2e-3);
    vec2 along = line / max(length(line), 1e-6), p = m - 0.5 * (clip_lines[i].xy + clip_lines[i].zw);
    vec2 q = vec2(dot(p, along), dot(p, vec2(-along.y, along.x)));
    float d = length(vec2(max(abs(q.x) - reach, 0.0), q.y));
    if (d >= kGather) continue;
    float w = 1.0 - d / kGather;
    w *= w;
    // Folds are lines of equal angle about a point behind the line: on it a millimetre apart, and fanned out from there.
    float fan = atan(q.x, abs(q.y) + reach) + 0.4 * (uneven - 0.5);
    float turn = sin(7.0 * fan + 1.7 * clamp(q.y / 1e-3, -1.0, 1.0) + 0.9 * float(i));
    float rise = sqrt(turn * turn + 0.012) * (0.7 + 0.3 * sin(5.0 * fan)); // Round ridges, narrow valleys.
    height += 3.4e-4 * w * rise;
    valley = max(valley, w * (1.1 - rise));
    drawn += along * (0.35 * q.x * w);
    away = min(away, d);
  }
}

// Normal of a surface of normal n with a relief of `height` [m] (Mikkelsen 2010).
vec3 Raised(vec3 n, float height) {
  vec3 across = dFdx(position), up = dFdy(position);
  vec3 r1 = cross(up, n), r2 = cross(n, across);
  float size = dot(across, r1);
  vec3 slope = sign(size) * (dFdx(height) * r1 + dFdy(height) * r2);
  return normalize(abs(size) * n - slope);
}
#endif

// Ink of the planned line: dashes half a millimetre wide.
float PlannedInk(vec2 m) {
  float edge = 0.5 * (fwidth(m.x) + fwidth(m.y)) + 5e-5; // Before any branch, which derivatives require.
  if (planned_points < 2 || any(lessThan(m, planned_box.xy)) || any(greaterThan(m, planned_box.zw))) return 0.0;
  float nearest = 1.0, along = 0.0, passed = 0.0;
  for (int i = 0; i + 1 < planned_points; ++i) {
    vec2 piece = planned_line[i + 1] - planned_line[i], from = m - planned_line[i];
    float u = clamp(dot(from, piece) / dot(piece, piece), 0.0, 1.0);
    float away = length(from - u * piece);
    if (away < nearest) {
      nearest = away;
      along = passed + u * length(piece);
    }
    passed += length(piece);
  }
  return (1.0 - smoothstep(2.5e-4, 2.5e-4 + edge, nearest)) * step(fract(along / 0.002), 0.65);
}

// Offset in (s, t) [m] from a point of the sheet to the point above the place of the fascia that the same pixel shows.
// It follows from the displacement in the picture of a step of `fascia_depth` along the normal.
vec2 ToFascia(vec2 m, vec3 n) {
  vec2 pixels = osg_ProjectionMatrix[1][1] * half_height * fascia_depth / -position.z *
                (n.xy - n.z * position.xy / position.z);
  vec2 step = pixels.x * dFdx(m) + pixels.y * dFdy(m);
  // Limited, because it would become infinite for a sheet that is seen edge on.
  return step * min(1.0, 4.0 * fascia_depth * inversesqrt(dot(step, step) + 1e-12));
}

void main() {
  vec2 m = coordinate.xy;
  vec2 m_fascia = m + ToFascia(m, normalize(normal));
#ifdef CLIPS
  float away, height, valley;
  vec2 drawn;
  Gathered(m, texture(serosa_pattern, m * 31.0).g, away, height, valley, drawn);
  float gathered = 1.0 - away / kGather;
  float pinched = 1.0 - smoothstep(0.0008, 0.0032, away);
  vec3 upright = Raised(normalize(normal), height);
#else
  vec3 upright = normal;
  const vec2 drawn = vec2(0.0);
#endif
  vec4 noise = texture(serosa_pattern, (m + drawn) * 16.0);
#ifdef UNTOUCHED // What follows from these constants is left out by the compiler.
  const vec4 heat = vec4(0.0, 0.0, 0.0, 1.0), heat_below = heat, wet_film = vec4(0.0);
  const float edge = 0.0, ink = 0.0, colour_by_temperature = 0.0;
#else
  vec4 heat = texture(atlas, m * atlas_per_metre);
  vec4 heat_below = texture(atlas, m_fascia * atlas_per_metre);
#ifdef AS_PRINTED
  heat.a = heat_below.a = 1.0; // The paper cuts no holes in the texture.
#endif
  if (coordinate.z < 0.0 || max(heat.a, heat_below.a) < 0.5) discard;
  vec4 wet_film = texture(film_map, m * film_per_metre);
#ifdef AS_PRINTED
  float edge = 0.0; // No holes, no rims.
#else
  float edge = wet_film.g;
  if (edge > kLipNearness) discard; // There the lips of the cut are drawn (cut.frag).
#endif
  float ink = PlannedInk(m);
#endif
  float vessel = noise.a;
#ifdef CLIPS
  // What is left in a vessel without supply has given off its oxygen.
  float still = texture(cut_off, m * film_per_metre).r;
  vec3 in_vessel = mix(vec3(0.46, 0.03, 0.03), vec3(0.25, 0.06, 0.12), still);
  vessel *= 1.0 - 0.35 * still;
#else
  const vec3 in_vessel = vec3(0.46, 0.03, 0.03);
#endif
  float celsius = 20.0 + 127.5 * heat.r;
  float damage = heat.g;
  float dry = clamp(2.0 * heat.b, 0.0, 1.0);
  float burnt = clamp(2.0 * heat.b - 1.0, 0.0, 1.0);

  vec3 bend = noise.rgb - 0.5;
  vec3 n = normalize(upright + 0.12 * bend);
  vec3 film = normalize(upright + 0.40 * bend + 0.80 * (texture(serosa_pattern, m * 115.0).rgb - 0.5));
  float facing = abs(dot(n, normalize(position)));
  float grazing = (1.0 - facing) * (1.0 - facing);
  vec3 albedo = mix(vec3(0.84, 0.40, 0.30), vec3(0.90, 0.60, 0.45), noise.g);
  float alpha = 0.21 + 0.22 * noise.r + 0.45 * grazing;

  // Towards its rim the sheet becomes what goes on there (surroundings.frag).
  float rim = smoothstep(0.15, 0.65, coordinate.w + 0.6 * bend.y);
  albedo = mix(albedo, AroundTheSheet(around.rgb, around.a, noise), rim);
  alpha = mix(alpha, 1.0, rim);

  float living = 1.0 - smoothstep(0.05, 0.5, damage);
  // Warm tissue reddens, then pales as its protein coagulates (from about 60 degrees).
  albedo = mix(albedo, vec3(0.72, 0.16, 0.13), 0.5 * living * smoothstep(41.0, 50.0, celsius));
  albedo = mix(albedo, in_vessel, 0.8 * vessel * living);
  alpha = mix(alpha, max(alpha, 0.60), vessel * living);
#ifdef CLIPS
  // Tissue that is drawn together is thick, redder around and drained of blood beside the legs.
  albedo = mix(albedo, vec3(0.74, 0.24, 0.19), 0.35 * gathered * (1.0 - pinched) * living);
  albedo = mix(albedo, vec3(0.94, 0.79, 0.69), 0.80 * pinched * living);
  alpha = mix(alpha, max(alpha, 0.75), smoothstep(0.1, 0.8, gathered));
#endif
  float pale = max(smoothstep(0.05, 0.55, damage), smoothstep(58.0, 75.0, celsius));
  albedo = mix(albedo, vec3(0.92, 0.82, 0.66), pale);
  alpha = mix(alpha, 0.80, pale);
  albedo = mix(albedo, vec3(0.06, 0.10, 0.42), 0.9 * ink);
  alpha = mix(alpha, 0.95, ink);
  // Fully coagulated tissue turns tan, dry tissue brown, charred tissue black.
  albedo = mix(albedo, vec3(0.46, 0.22, 0.08), 0.9 * smoothstep(0.3, 0.8, damage));
  float brown = smoothstep(0.02, 0.4, dry);
  albedo = mix(albedo, vec3(0.22, 0.075, 0.022) * (0.5 + noise.b), brown);
  alpha = mix(alpha, 0.97, brown);
  albedo = mix(albedo, vec3(0.035, 0.022, 0.015), smoothstep(0.05, 0.6, burnt));

  float hot = colour_by_temperature * clamp((celsius - 45.0) / 55.0, 0.0, 1.0);
  albedo = mix(albedo, vec3(0.22, 0.075, 0.022), hot);
  alpha = mix(alpha, 0.95, hot);
  // Towards the lips of a slit it is thick and blanched, as their flat part is.
  float lip = smoothstep(0.25, kLipNearness, edge + 0.15 * bend.z);
  albedo = mix(albedo, vec3(0.85, 0.62, 0.49), 0.7 * lip);
  alpha = mix(alpha, 0.90, lip);
  // Blood lies on top, and seeps away where the sheet ends on the organ. A clot is darker and duller.
  float blood = 2.0 * wet_film.r * (1.0 - (coordinate.w < 0.0 ? smoothstep(0.5, 0.95, -coordinate.w) : smoothstep(0.93, 1.0, coordinate.w)));
  float bloody = smoothstep(0.0, 0.35, blood);
  float clot = bloody * ClotShare(wet_film);
  albedo = mix(ThroughBlood(albedo, blood), kClot * (0.5 + noise.b), 0.85 * clot);
  alpha = mix(alpha, 0.97, bloody);
#ifndef UNTOUCHED
  film = normalize(mix(film, normal + (0.5 + 0.6 * clot) * bend, bloody));
#endif

#ifdef CLIPS
  // Little light reaches the bottom of the folds, and the tissue beside the metal.
  float dark = max(0.80 * smoothstep(0.12, 0.7, valley), 0.95 * (1.0 - smoothstep(0.0005, 0.0019, away)));
  albedo *= 1.0 - dark * vec3(0.75, 0.95, 0.95);
#else
  const float dark = 0.0;
#endif
  float wet = mix(1.6 * (1.0 - 0.92 * max(brown, 0.3 * pale)), 1.8 - 1.0 * clot, bloody);
  // Water darkens a little, and is smoother than the tissue's own film.
  float rinsed = smoothstep(0.0, 0.25, wet_film.a);
  albedo *= 1.0 - 0.12 * rinsed;
#ifndef UNTOUCHED
  film = normalize(mix(film, normal + 0.35 * bend, rinsed));
#endif
  wet += 0.7 * rinsed;
  wet *= 1.0 - dark;

  // The fascia's fibres run obliquely across the organ with varying density; burns of the peritoneum apply to them as
  // well.
  vec4 fibres = texture(serosa_pattern, vec2(dot(m_fascia + drawn, vec2(22.0, 9.0)), dot(m_fascia + drawn, vec2(-65.0, 130.0))));
  float strand = smoothstep(0.44, 0.70, fibres.r) * (0.3 + 1.2 * fibres.g * noise.b);
  float seared = smoothstep(0.02, 0.4, 2.0 * heat_below.b);
  float tanned = 0.6 * smoothstep(0.1, 0.5, heat_below.g);
  vec3 fascia = mix(vec3(0.86, 0.76, 0.66), vec3(0.26, 0.10, 0.035), seared);
  vec4 upper = vec4(albedo, heat.a < 0.5 ? 0.0 : alpha);
  vec4 lower = vec4(fascia, heat_below.a < 0.5 ? 0.0 : mix(0.09 + 0.30 * strand, 0.9, max(seared, tanned)));
  // A line of sight that enters through the slit of the fascia from beneath and meets the peritoneum has met the wall of
  // the cut between the two; from above the lip is before it.
  bool from_above = dot(normal, position) < 0.0;
  vec4 raw = vec4(mix(mix(vec3(0.80, 0.52, 0.40), vec3(0.56, 0.33, 0.17), tanned), vec3(0.26, 0.12, 0.05), seared), 0.97);
  if (!from_above && heat_below.a < 0.5) upper = raw;
#ifdef AS_PRINTED
  float v = clamp((celsius - printed_limits.x) / (printed_limits.y - printed_limits.x), 0.0, 1.0);
  int which = v > printed_limits.z ? 0 : v > printed_limits.w ? 1 : 2;
  upper = (1.0 - v) * upper + v * printed_colours[which];
  lower.a = 0.001; // One layer; not 0, by which the mean of both would be divided where v is 1.
  wet *= 1.0 - v;
#endif
  vec4 near = from_above ? upper : lower, far = from_above ? lower : upper;
  float through = (1.0 - near.a) * far.a, both = near.a + through;
  albedo = (near.a * near.rgb + through * far.rgb) / both;
  wet *= from_above && heat.a >= 0.5 ? 1.0 : 0.4;

  // Highlights are opaque.
  float gloss;
  vec3 shaded = ShadeTissue(tissue_tint * albedo, vec3(0.30, 0.16, 0.10), n, film, position, wet, gloss);
  // The sheet ends where its tissue does, or fades into the organ.
  float end = coordinate.w < 0.0 ? smoothstep(0.25, 0.85, -coordinate.w + 0.5 * bend.y) : smoothstep(0.93, 1.0, coordinate.w);
  fragment = vec4(ToneMap(shaded), min(both + 0.8 * gloss, 1.0) * (1.0 - end));
}
