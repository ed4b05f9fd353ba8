// GLSL of a point's place on the screen, and of its size, which falls with the distance.

const PLACE = `
uniform mat4 matrix;
uniform vec3 origin;
uniform float point_size;  // m, about
uniform float pixels;      // per metre at distance 1
uniform float least_size;  // pixels
uniform bool is_flat;

void place(vec3 local) {
  gl_Position = matrix * vec4(local, 1.0);
  float depth = is_flat ? 1.0 : gl_Position.w;
  gl_PointSize = clamp(point_size * pixels / depth, least_size, 24.0);
}`;
