// Draws the points of a run.

class Renderer {
  constructor(canvas, points) {
    this.screen = new Screen(canvas);
    this.gl = this.screen.gl;
    this.canvas = canvas;
    this.points = points;
    const {gl} = this;
    this.program = compiled(gl, POINT_VERTEX, POINT_FRAGMENT);
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    points.columns.forEach((column, location) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, column, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(location);
      const type = column instanceof Int32Array ? gl.INT : gl.UNSIGNED_BYTE;
      gl.vertexAttribIPointer(location, 1, type, 0, 0);
    });
    gl.bindVertexArray(null);
  }

  drawPoints(state, isPicking) {
    const {gl, canvas, points} = this;
    const view = state.camera.matrix(canvas.width / canvas.height);
    const {program, uniforms: u} = this.program;
    this.screen.begin();
    gl.useProgram(program);
    gl.bindVertexArray(this.array);
    const metresAtOne = 2 * Math.tan(FIELD_OF_VIEW / 2) * (view.isFlat ? state.camera.distance : 1);
    gl.uniformMatrix4fv(u.matrix, false, view.matrix);
    gl.uniform1f(u.point_size, 0.1 * state.size);
    gl.uniform1f(u.pixels, canvas.height / metresAtOne);
    gl.uniform1f(u.least_size, state.size * (window.devicePixelRatio || 1));
    gl.uniform1i(u.is_flat, view.isFlat);
    gl.uniform1i(u.colour_mode, state.colour);
    gl.uniform2fv(u.heights, state.heights);
    gl.uniform1f(u.unit, points.unit);
    gl.uniform1f(u.split, 2 * state.split - 1);
    gl.uniform1i(u.current_scan, state.allScans ? -1 : state.scan);
    gl.uniform1ui(u.causes, state.causes);
    gl.uniform3fv(u.cause_colours, CAUSE_COLOURS.flat());
    gl.uniform1i(u.is_picking, isPicking);
    gl.uniform1i(u.map_points, points.counts[0]);
    gl.drawArrays(gl.POINTS, 0, points.total);
    return view;
  }

  draw(state) {
    this.screen.resize();
    const view = this.drawPoints(state, false);
    this.screen.shade(view, state.shading);
  }

  // Index of the point nearest to a position in pixels of the page, within 7 pixels; -1 if none.
  pick(state, x, y) {
    this.screen.resize();
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
