// Functions of GLSL for colours: a ramp from 0 to 1, and one hue for each number.

const COLOURS = `
vec3 ramp(float t) {
  t = clamp(t, 0.0, 1.0);
  vec3 low = mix(vec3(0.16, 0.23, 0.55), vec3(0.14, 0.62, 0.62), smoothstep(0.0, 0.4, t));
  vec3 high = mix(vec3(0.55, 0.78, 0.35), vec3(0.98, 0.86, 0.30), smoothstep(0.6, 1.0, t));
  return mix(low, high, smoothstep(0.25, 0.75, t));
}

vec3 hue(float h) {
  vec3 k = abs(fract(h + vec3(0.0, 0.667, 0.333)) * 6.0 - 3.0) - 1.0;
  return mix(vec3(1.0), clamp(k, 0.0, 1.0), 0.75);
}`;
