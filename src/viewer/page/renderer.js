// Draws points into a texture, then shades them onto the canvas.

const BACKGROUND = [18 / 255, 22 / 255, 28 / 255];

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

class Renderer {
  constructor(canvas, points) {
    const gl = canvas.getContext('webgl2', {antialias: false, preserveDrawingBuffer: true});
    if (!gl) throw new Error('This page needs WebGL 2, which this browser does not offer.');
    this.gl = gl;
    this.canvas = canvas;
    this.points = points;
    this.pointProgram = compiled(gl, POINT_VERTEX, POINT_FRAGMENT);
    this.screenProgram = compiled(gl, SCREEN_VERTEX, SCREEN_FRAGMENT);
    this.emptyArray = gl.createVertexArray();
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, points.vertices, gl.STATIC_DRAW);
    const attribute = (location, size, type, offset) => {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribIPointer(location, size, type, VERTEX_BYTES, offset);
    };
    attribute(0, 4, gl.UNSIGNED_SHORT, 0);
    attribute(1, 1, gl.UNSIGNED_SHORT, 8);
    attribute(2, 4, gl.UNSIGNED_BYTE, 10);
    gl.bindVertexArray(null);
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

  drawPoints(state, isPicking) {
    const {gl, canvas, points} = this;
    const view = state.camera.matrix(canvas.width / canvas.height);
    const {program, uniforms: u} = this.pointProgram;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(program);
    gl.bindVertexArray(this.array);
    gl.uniformMatrix4fv(u.matrix, false, view.matrix);
    gl.uniform1f(u.unit, points.unit);
    gl.uniform1f(u.point_size, 0.1 * state.size);
    const metresAtOne = 2 * Math.tan(FIELD_OF_VIEW / 2) * (view.isFlat ? state.camera.distance : 1);
    gl.uniform1f(u.pixels, canvas.height / metresAtOne);
    gl.uniform1f(u.least_size, state.size * (window.devicePixelRatio || 1));
    gl.uniform1i(u.is_flat, view.isFlat);
    gl.uniform1f(u.split, 2 * state.split - 1);
    gl.uniform1i(u.current_scan, state.allScans ? -1 : state.scan);
    gl.uniform1ui(u.causes, state.causes);
    gl.uniform1i(u.colour_mode, state.colour);
    gl.uniform2fv(u.heights, state.heights);
    gl.uniform3fv(u.cause_colours, CAUSE_COLOURS.flat());
    gl.uniform1i(u.is_picking, isPicking);
    for (const chunk of points.chunks) {
      gl.uniform3fv(u.origin, chunk.origin);
      gl.uniform1i(u.is_moving_layer, chunk.layer);
      gl.drawArrays(gl.POINTS, chunk.first, chunk.count);
    }
    return view;
  }

  draw(state) {
    this.resize();
    const {gl} = this;
    const view = this.drawPoints(state, false);
    const {program, uniforms: u} = this.screenProgram;
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
    gl.uniform1f(u.strength, state.shading);
    gl.uniform3fv(u.background, BACKGROUND);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  // Index of the point nearest to a position in pixels of the page, within 7 pixels; -1 if none.
  pick(state, x, y) {
    this.resize();
    const {gl, canvas} = this;
    const ratio = canvas.width / canvas.clientWidth;
    const reach = 7;
    const side = 2 * reach + 1;
    const left = Math.round(x * ratio) - reach;
    const bottom = canvas.height - 1 - Math.round(y * ratio) - reach;
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(left, bottom, side, side);
    this.drawPoints(state, true);
    gl.disable(gl.SCISSOR_TEST);
    const pixels = new Uint8Array(4 * side * side);
    gl.readPixels(left, bottom, side, side, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    let best = -1;
    let least = Infinity;
    for (let i = 0; i < side * side; ++i) {
      const id = new DataView(pixels.buffer).getUint32(4 * i, true);
      const distance = Math.hypot(i % side - reach, Math.floor(i / side) - reach);
      if (id === 0 || distance >= least) continue;
      least = distance;
      best = id - 1;
    }
    return best;
  }
}
