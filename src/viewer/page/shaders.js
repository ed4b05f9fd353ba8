// Colours: 0 moving instances, 1 height, 2 intensity, 3 label, 4 belief, 5 cause, 6 errors.

const POINT_VERTEX = `#version 300 es
precision highp float;
precision highp int;
layout(location = 0) in int x;
layout(location = 1) in int y;
layout(location = 2) in int z;
layout(location = 3) in int scan;
layout(location = 4) in int instance;
layout(location = 5) in uint intensity;
layout(location = 6) in uint belief;
layout(location = 7) in uint cause;
layout(location = 8) in uint flags;  // label + 4 * truth
uniform mat4 matrix;
uniform float point_size;  // m, about
uniform float pixels;      // per metre at distance 1
uniform float least_size;  // pixels
uniform bool is_flat;
uniform float unit;
uniform float split;         // border between before and after, from -1 to 1
uniform int map_points;      // moving ones follow
uniform int current_scan;    // -1: all scans
uniform uint causes;         // bit set
uniform int colour_mode;
uniform vec2 heights;
uniform vec3 cause_colours[19];
uniform bool is_picking;
flat out vec4 colour;

// The size falls with the distance.
void place(vec3 local) {
  gl_Position = matrix * vec4(local, 1.0);
  float depth = is_flat ? 1.0 : gl_Position.w;
  gl_PointSize = clamp(point_size * pixels / depth, least_size, 24.0);
}

// From 0 to 1.
vec3 ramp(float t) {
  t = clamp(t, 0.0, 1.0);
  vec3 low = mix(vec3(0.16, 0.23, 0.55), vec3(0.14, 0.62, 0.62), smoothstep(0.0, 0.4, t));
  vec3 high = mix(vec3(0.55, 0.78, 0.35), vec3(0.98, 0.86, 0.30), smoothstep(0.6, 1.0, t));
  return mix(low, high, smoothstep(0.25, 0.75, t));
}

vec3 hue(float h) {
  vec3 k = abs(fract(h + vec3(0.0, 0.667, 0.333)) * 6.0 - 3.0) - 1.0;
  return mix(vec3(1.0), clamp(k, 0.0, 1.0), 0.75);
}

vec3 colour_of(float height) {
  uint label = flags & 3u;
  uint truth = flags >> 2;
  float t = (height - heights.x) / (heights.y - heights.x);
  vec3 grey = vec3(0.40 + 0.35 * clamp(t, 0.0, 1.0));
  vec3 by_instance = instance == 0 ? vec3(0.95, 0.45, 0.35) : hue(fract(float(instance) * 0.618034));
  if (colour_mode == 1) return ramp(t);
  if (colour_mode == 2) return vec3(0.1 + 0.9 * sqrt(float(intensity) / 255.0));
  if (colour_mode == 3) {
    if (label == 2u) return vec3(0.95, 0.25, 0.20);
    return cause == 1u ? vec3(0.55, 0.47, 0.38) : vec3(0.45, 0.62, 0.80);
  }
  if (colour_mode == 4) return ramp(float(belief) / 255.0);
  if (colour_mode == 5) return cause_colours[min(cause, 18u)];
  if (colour_mode == 6) {
    if (truth == 0u) return vec3(0.25, 0.27, 0.32);
    if (label == 2u) {
      return truth == 2u ? vec3(0.12, 0.63, 0.24)
        : truth == 3u ? vec3(0.95, 0.30, 0.90) : vec3(1.0, 0.55, 0.0);
    }
    return truth == 2u ? vec3(0.86, 0.08, 0.12)
      : truth == 3u ? vec3(0.45, 0.62, 0.80) * (0.7 + 0.3 * clamp(t, 0.0, 1.0)) : grey;
  }
  return label == 2u ? by_instance : grey;
}

bool is_hidden(bool is_moving) {
  if ((causes >> min(cause, 31u) & 1u) == 0u) return true;
  if (current_scan < 0) return false;
  // The map grows; moving points are shown at their scan.
  return is_moving ? scan != current_scan : scan > current_scan;
}

void main() {
  vec3 local = unit * vec3(x, y, z);
  place(local);
  bool is_after = gl_Position.x > split * gl_Position.w;
  bool is_moving = gl_VertexID >= map_points;
  if (is_hidden(is_moving) || (is_moving && is_after)) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    gl_PointSize = 0.0;
    return;
  }
  if (is_picking) {
    uint id = uint(gl_VertexID) + 1u;
    colour = vec4(uvec4(id, id >> 8, id >> 16, id >> 24) & 255u) / 255.0;
  } else {
    colour = vec4(colour_of(local.z), 1.0);
  }
}`;
