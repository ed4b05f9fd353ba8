// A canvas whose points are drawn into a texture first, and then shaded.

const BACKGROUND = [18 / 255, 22 / 255, 28 / 255];

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

function compiled(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
    const logs = gl.getAttachedShaders(program).map((shader) => gl.getShaderInfoLog(shader));
    throw new Error(gl.getProgramInfoLog(program) + logs.join(''));
  }
  const uniforms = {};
  const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
  for (let i = 0; i < count; ++i) {
    const {name} = gl.getActiveUniform(program, i);
    uniforms[name.replace('[0]', '')] = gl.getUniformLocation(program, name);
  }
  return {program, uniforms};
}

class Screen {
  constructor(canvas) {
    const gl = canvas.getContext('webgl2', {antialias: false, preserveDrawingBuffer: true});
    if (!gl) throw new Error('This page needs WebGL 2, which this browser does not offer.');
    this.gl = gl;
    this.canvas = canvas;
    this.program = compiled(gl, SCREEN_VERTEX, SCREEN_FRAGMENT);
    this.emptyArray = gl.createVertexArray();
    this.frame = gl.createFramebuffer();
  }

  resize() {
    const {gl, canvas} = this;
    const ratio = window.devicePixelRatio || 1;
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (this.colours && canvas.width === width && canvas.height === height) return;
    canvas.width = width;
    canvas.height = height;
    const texture = (old, format, attachment) => {
      if (old) gl.deleteTexture(old);
      const result = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, result);
      gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, attachment, gl.TEXTURE_2D, result, 0);
      return result;
    };
    this.colours = texture(this.colours, gl.RGBA8, gl.COLOR_ATTACHMENT0);
    this.depths = texture(this.depths, gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT);
  }

  // Points are drawn after this call.
  begin() {
    const {gl, canvas} = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  }

  // Eye-dome lighting onto the canvas.
  shade(view, strength) {
    const {gl} = this;
    const {program, uniforms: u} = this.program;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.disable(gl.DEPTH_TEST);
    gl.useProgram(program);
    gl.bindVertexArray(this.emptyArray);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.colours);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.depths);
    gl.uniform1i(u.colours, 0);
    gl.uniform1i(u.depths, 1);
    gl.uniform2f(u.range, view.near, view.far);
    gl.uniform1i(u.is_flat, view.isFlat);
    gl.uniform1f(u.strength, strength);
    gl.uniform3fv(u.background, BACKGROUND);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }
}
