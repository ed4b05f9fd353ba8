// Colours: 0 moving instances, 1 height, 2 intensity, 3 label, 4 belief, 5 cause, 6 errors.

const POINT_VERTEX = `#version 300 es
precision highp float;
precision highp int;
layout(location = 0) in uvec4 position_instance;
layout(location = 1) in uint scan;
layout(location = 2) in uvec4 bytes;  // intensity, belief, cause, label + 4 * truth
uniform mat4 matrix;
uniform vec3 origin;
uniform float unit;
uniform float point_size;    // m, about
uniform float pixels;        // per metre at distance 1
uniform float least_size;    // pixels
uniform bool is_flat;
uniform float split;         // border between before and after, from -1 to 1
uniform bool is_moving_layer;
uniform int current_scan;    // -1: all scans
uniform uint causes;         // bit set
uniform int colour_mode;
uniform vec2 heights;
uniform vec3 cause_colours[17];
uniform bool is_picking;
flat out vec4 colour;

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
  uint instance = position_instance.w;
  uint label = bytes.w & 3u;
  uint truth = bytes.w >> 2;
  float t = (height - heights.x) / (heights.y - heights.x);
  vec3 grey = vec3(0.40 + 0.35 * clamp(t, 0.0, 1.0));
  vec3 by_instance = instance == 0u ? vec3(0.95, 0.45, 0.35) : hue(fract(float(instance) * 0.618034));
  if (colour_mode == 1) return ramp(t);
  if (colour_mode == 2) return vec3(0.1 + 0.9 * sqrt(float(bytes.x) / 255.0));
  if (colour_mode == 3) {
    if (label == 2u) return vec3(0.95, 0.25, 0.20);
    return bytes.z == 1u ? vec3(0.55, 0.47, 0.38) : vec3(0.45, 0.62, 0.80);
  }
  if (colour_mode == 4) return ramp(float(bytes.y) / 255.0);
  if (colour_mode == 5) return cause_colours[min(bytes.z, 16u)];
  if (colour_mode == 6) {
    if (truth == 0u) return vec3(0.25, 0.27, 0.32);
    if (label == 2u) return truth == 2u ? vec3(0.12, 0.63, 0.24) : vec3(1.0, 0.55, 0.0);
    return truth == 2u ? vec3(0.86, 0.08, 0.12) : grey;
  }
  return label == 2u ? by_instance : grey;
}

bool is_hidden() {
  if ((causes >> min(bytes.z, 31u) & 1u) == 0u) return true;
  if (current_scan < 0) return false;
  // The map grows; moving points are shown at their scan.
  return is_moving_layer ? int(scan) != current_scan : scan != 65535u && int(scan) > current_scan;
}

void main() {
  vec3 local = origin + unit * vec3(position_instance.xyz);
  gl_Position = matrix * vec4(local, 1.0);
  bool is_after = gl_Position.x > split * gl_Position.w;
  if (is_hidden() || (is_moving_layer && is_after)) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    gl_PointSize = 0.0;
    return;
  }
  float depth = is_flat ? 1.0 : gl_Position.w;
  gl_PointSize = clamp(point_size * pixels / depth, least_size, 24.0);
  if (is_picking) {
    uint id = uint(gl_VertexID) + 1u;
    colour = vec4(uvec4(id, id >> 8, id >> 16, id >> 24) & 255u) / 255.0;
  } else {
    colour = vec4(colour_of(local.z), 1.0);
  }
}`;

const POINT_FRAGMENT = `#version 300 es
precision mediump float;
flat in highp vec4 colour;
out highp vec4 result;
void main() { result = colour; }`;

const SCREEN_VERTEX = `#version 300 es
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}`;

// Eye-dome lighting: a pixel gets darker, the farther it lies behind its neighbours.
const SCREEN_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D colours;
uniform highp sampler2D depths;
uniform vec2 range;  // near, far, m
uniform bool is_flat;
uniform float strength;
uniform vec3 background;
out vec4 result;

float log_depth(ivec2 pixel) {
  float d = texelFetch(depths, clamp(pixel, ivec2(0), textureSize(depths, 0) - 1), 0).r;
  if (d >= 1.0) return 1e6;
  float metres = is_flat ? mix(range.x, range.y, d)
                         : range.x * range.y / (range.y - d * (range.y - range.x));
  return log2(metres);
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float depth = log_depth(pixel);
  if (depth > 1e5) {
    result = vec4(background, 1.0);
    return;
  }
  const ivec2 around[8] = ivec2[8](ivec2(1, 0), ivec2(-1, 0), ivec2(0, 1), ivec2(0, -1),
                                   ivec2(1, 1), ivec2(-1, 1), ivec2(1, -1), ivec2(-1, -1));
  float behind = 0.0;
  for (int i = 0; i < 8; ++i) {
    behind += min(max(0.0, depth - log_depth(pixel + around[i])), 0.2);
  }
  vec3 colour = texelFetch(colours, pixel, 0).rgb;
  result = vec4(colour * exp(-6.0 * strength * behind), 1.0);
}`;
