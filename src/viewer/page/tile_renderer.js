// Draws tiles of points. Colours: 1 height, 2 intensity, 3 label, 4 session.

const TILE_VERTEX = `#version 300 es
precision highp float;
precision highp int;
layout(location = 0) in vec3 position;
layout(location = 1) in uint label;
layout(location = 2) in uvec2 bytes;  // session, intensity
uniform int colour_mode;
uniform vec2 heights;
flat out vec4 colour;

${PLACE}
${COLOURS}

vec3 colour_of(float height) {
  if (colour_mode == 2) return vec3(0.1 + 0.9 * sqrt(float(bytes.y) / 255.0));
  if (colour_mode == 3) return label == 0u ? vec3(0.5) : hue(fract(float(label) * 0.618034));
  if (colour_mode == 4) return hue(fract(float(bytes.x) * 0.618034));
  return ramp((height - heights.x) / (heights.y - heights.x));
}

void main() {
  vec3 local = origin + position;
  place(local);
  colour = vec4(colour_of(local.z), 1.0);
}`;

class TileRenderer {
  constructor(canvas) {
    this.screen = new Screen(canvas);
    this.gl = this.screen.gl;
    this.canvas = canvas;
    this.program = compiled(this.gl, TILE_VERTEX, POINT_FRAGMENT);
  }

  upload(decoded, origin) {
    const {gl} = this;
    const array = gl.createVertexArray();
    const buffer = gl.createBuffer();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, decoded.vertices, gl.STATIC_DRAW);
    for (const location of [0, 1, 2]) gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, TILE_VERTEX_BYTES, 0);
    gl.vertexAttribIPointer(1, 1, gl.UNSIGNED_SHORT, TILE_VERTEX_BYTES, 12);
    gl.vertexAttribIPointer(2, 2, gl.UNSIGNED_BYTE, TILE_VERTEX_BYTES, 14);
    gl.bindVertexArray(null);
    const place = decoded.centre.map((value, axis) => value - origin[axis]);
    return {array, buffer, place, total: decoded.total, heights: heightsOf(decoded, place[2])};
  }

  free(content) {
    this.gl.deleteVertexArray(content.array);
    this.gl.deleteBuffer(content.buffer);
  }

  view(state) {
    this.screen.resize();
    const {canvas} = this;
    return {...state.camera.matrix(canvas.width / canvas.height), distance: state.camera.distance};
  }

  draw(state, view, tiles) {
    const {gl} = this;
    const {program, uniforms: u} = this.program;
    this.screen.begin();
    gl.useProgram(program);
    this.screen.setView(u, view, state);
    for (const {content} of tiles) {
      gl.bindVertexArray(content.array);
      gl.uniform3fv(u.origin, content.place);
      gl.drawArrays(gl.POINTS, 0, content.total);
    }
    this.screen.shade(view, state.shading);
  }
}

// What most heights of a tile lie between, m, in the frame of the page.
function heightsOf(decoded, above) {
  const floats = new Float32Array(decoded.vertices);
  const heights = [];
  const step = Math.max(1, Math.floor(decoded.total / 20000));
  for (let i = 0; i < decoded.total; i += step) heights.push(above + floats[4 * i + 2]);
  return rangeOf(heights);
}
