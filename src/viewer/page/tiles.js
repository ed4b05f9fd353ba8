// Tiles of points of an OGC 3D Tiles set (1.0, .pnts, refine ADD, upright boxes): which of them are
// shown, loaded and freed.

const MOST_REQUESTS = 4;
const TILE_VERTEX_BYTES = 16;

// Vertices: float x y z from the centre of the tile; uint16 label; uint8 session, intensity.
function decodeTile(buffer, intensityScale) {
  const view = new DataView(buffer);
  const text = (begin, length) => new TextDecoder().decode(new Uint8Array(buffer, begin, length));
  if (buffer.byteLength < 28 || text(0, 4) !== 'pnts' || view.getUint32(8, true) !== buffer.byteLength) {
    throw new Error('a tile is damaged');
  }
  const sizes = [12, 16, 20, 24].map((offset) => view.getUint32(offset, true));
  const features = JSON.parse(text(28, sizes[0]));
  const begin = 28 + sizes[0];
  const batch = sizes[2] ? JSON.parse(text(begin + sizes[1], sizes[2])) : {};
  const columns = begin + sizes[1] + sizes[2];
  const total = features.POINTS_LENGTH;
  const positions = new Float32Array(buffer, begin + features.POSITION.byteOffset, 3 * total);
  const column = (name, Type) => batch[name] && new Type(buffer, columns + batch[name].byteOffset, total);
  const intensity = column('intensity', Float32Array);
  const label = column('label', Uint32Array);
  const session = column('session', Uint16Array);
  const scale = intensityScale ?? (intensity ? 255 / rangeOf([...intensity])[1] : 1);
  const vertices = new ArrayBuffer(TILE_VERTEX_BYTES * total);
  const floats = new Float32Array(vertices);
  const words = new Uint16Array(vertices);
  const octets = new Uint8ClampedArray(vertices);
  for (let i = 0; i < total; ++i) {
    floats[4 * i] = positions[3 * i];
    floats[4 * i + 1] = positions[3 * i + 1];
    floats[4 * i + 2] = positions[3 * i + 2];
    if (label) words[8 * i + 6] = label[i] & 0xffff;
    if (session) octets[16 * i + 14] = session[i] & 0xff;
    if (intensity) octets[16 * i + 15] = scale * intensity[i];
  }
  return {total, vertices, centre: features.RTC_CENTER, intensityScale: scale};
}

class Tile {
  // `origin`: m, world; positions of the page are relative to it.
  constructor(json, origin) {
    const box = json.boundingVolume.box;
    this.centre = [0, 1, 2].map((axis) => box[axis] - origin[axis]);
    this.half = [box[3], box[7], box[11]];
    this.error = json.geometricError;  // m
    this.uri = json.content.uri;
    this.points = json.extras.points;
    this.children = (json.children ?? []).map((child) => new Tile(child, origin));
    this.state = 'absent';  // loading, loaded, failed
    this.content = null;  // of the renderer
    this.lastShown = 0;  // frame
  }

  distanceTo(eye) {
    return Math.hypot(...[0, 1, 2].map(
      (axis) => Math.max(0, Math.abs(eye[axis] - this.centre[axis]) - this.half[axis])));
  }

  // Whether a part of the box may be visible: not all corners are beyond one side of the view.
  isVisible(matrix) {
    const beyond = [0, 0, 0, 0, 0, 0];
    for (let corner = 0; corner < 8; ++corner) {
      const p = [0, 1, 2].map(
        (axis) => this.centre[axis] + (corner >> axis & 1 ? 1 : -1) * this.half[axis]);
      const [x, y, z, w] = [0, 1, 2, 3].map((row) =>
        matrix[row] * p[0] + matrix[4 + row] * p[1] + matrix[8 + row] * p[2] + matrix[12 + row]);
      [x < -w, x > w, y < -w, y > w, z < -w, z > w].forEach((is, side) => { beyond[side] += is; });
    }
    return !beyond.includes(8);
  }
}

class TileSet {
  // `renderer` has upload(decoded) and free(content); onChange() is called when tiles came.
  constructor(json, renderer, onChange) {
    this.origin = json.root.boundingVolume.box.slice(0, 3);
    this.root = new Tile(json.root, this.origin);
    this.total = json.extras.points;
    this.attributes = json.extras.attributes;
    this.renderer = renderer;
    this.onChange = onChange;
    this.loaded = new Set();
    this.requests = 0;
    this.frame = 0;
    this.missing = 0;  // chosen tiles that are not loaded
    this.failure = null;
  }

  loadedPoints() {
    let sum = 0;
    for (const tile of this.loaded) sum += tile.points;
    return sum;
  }

  // Tiles to draw. `budget`: most points that are loaded. `limit`: least error on the screen, in
  // pixels, of tiles that are shown in more detail.
  select(view, height, budget, limit) {
    ++this.frame;
    const pixels = height / (2 * Math.tan(FIELD_OF_VIEW / 2));
    const errorOf = (parent, tile) =>
      parent.error * pixels / (view.isFlat ? view.distance : Math.max(view.near, tile.distanceTo(view.eye)));
    const chosen = [];
    const open = [{tile: this.root, error: Infinity}];
    let points = 0;
    while (open.length > 0) {
      // The largest error first: if the budget does not suffice, what is missing is small.
      let best = 0;
      open.forEach((entry, i) => { if (entry.error > open[best].error) best = i; });
      const [{tile}] = open.splice(best, 1);
      if (points + tile.points > budget && tile !== this.root) break;
      points += tile.points;
      chosen.push(tile);
      for (const child of tile.children) {
        const error = errorOf(tile, child);
        if (error > limit && child.isVisible(view.matrix)) open.push({tile: child, error});
      }
    }
    for (const tile of chosen) tile.lastShown = this.frame;
    this.missing = chosen.filter((tile) => tile.state === 'absent' || tile.state === 'loading').length;
    this.free(budget);
    for (const tile of chosen) {
      if (tile.state === 'absent' && this.requests < MOST_REQUESTS) this.load(tile);
    }
    return chosen.filter((tile) => tile.state === 'loaded');
  }

  // Frees tiles that have not been shown for longest, until the budget suffices.
  free(budget) {
    let points = this.loadedPoints();
    const unused = [...this.loaded].filter((tile) => tile.lastShown !== this.frame)
      .sort((a, b) => a.lastShown - b.lastShown);
    for (const tile of unused) {
      if (points <= budget) return;
      this.renderer.free(tile.content);
      tile.content = null;
      tile.state = 'absent';
      this.loaded.delete(tile);
      points -= tile.points;
    }
  }

  async load(tile) {
    tile.state = 'loading';
    ++this.requests;
    try {
      const answer = await fetch(tile.uri);
      if (!answer.ok) throw new Error(`${tile.uri}: the server answers ${answer.status}`);
      const decoded = decodeTile(await answer.arrayBuffer(), this.intensityScale);
      this.intensityScale = decoded.intensityScale;
      tile.content = this.renderer.upload(decoded, this.origin);
      tile.state = 'loaded';
      this.loaded.add(tile);
    } catch (error) {
      tile.state = 'failed';
      this.failure = error;
    }
    --this.requests;
    this.onChange();
  }
}
