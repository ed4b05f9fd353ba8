// The page of a map in tiles: state, input and the loop.

class MapViewer {
  constructor(json) {
    this.renderer = new TileRenderer(element('canvas'));
    this.tiles = new TileSet(json, this.renderer, () => this.request());
    const [x, y, z] = this.tiles.root.half;
    const size = Math.hypot(x, y);
    const camera = new Camera([0, 0, -z], Math.PI / 2, Math.max(20, 1.5 * size));
    camera.reach = Math.max(2000, 4 * size);
    this.state = {camera, colour: 1, size: 1.5, shading: 0.7, heights: [-z, z], budget: 1e6, limit: 16};
    this.shown = [];
    element('colour').replaceChildren(...[['height', 1], ['intensity', 2], ['label', 3], ['session', 4]]
      .filter(([name]) => name === 'height' || this.tiles.attributes.includes(name))
      .map(([name, value]) => new Option(name, value)));
    this.connectPanel();
    connectCamera(element('canvas'), camera, () => this.request());
    new ResizeObserver(() => this.request()).observe(element('canvas'));
    this.request();
  }

  connectPanel() {
    const number = (id, name, scale = 1) => element(id).addEventListener('input', (event) => {
      this.state[name] = Number(event.target.value) * scale;
      this.request();
    });
    number('colour', 'colour');
    number('size', 'size');
    number('shading', 'shading');
    number('budget', 'budget', 1e6);
    for (const box of document.querySelectorAll('input[name=camera]')) {
      box.addEventListener('input', () => {
        this.state.camera.mode = box.value;
        this.request();
      });
    }
  }

  tellState() {
    const {tiles, shown} = this;
    const points = shown.reduce((sum, tile) => sum + tile.points, 0);
    const megabytes = tiles.loadedPoints() * TILE_VERTEX_BYTES / 1e6;
    element('summary').textContent = `${count(tiles.total)} points. Shown: ${count(points)} in ` +
      `${count(shown.length)} tiles. Loaded: ${count(tiles.loaded.size)} tiles, ${megabytes.toFixed(1)} MB` +
      (tiles.missing ? `; ${tiles.missing} tiles to come` : '');
    if (tiles.failure) fail(tiles.failure);
  }

  draw() {
    const {state, tiles, renderer} = this;
    const view = renderer.view(state);
    this.shown = tiles.select(view, renderer.canvas.height, state.budget, state.limit);
    if (tiles.root.content) state.heights = tiles.root.content.heights;
    renderer.draw(state, view, this.shown);
    this.tellState();
  }

  // Whether all tiles of this view are shown.
  isComplete() {
    return !this.requested && this.tiles.missing === 0 && this.tiles.requests === 0;
  }

  request() {
    if (this.requested) return;
    this.requested = true;
    requestAnimationFrame(() => {
      this.requested = false;
      this.draw();
    });
  }
}

function fail(error) {
  element('failure').textContent = error.message;
  element('failure').hidden = false;
}

async function start() {
  const answer = await fetch('tileset.json');
  if (!answer.ok) throw new Error(`tileset.json: the server answers ${answer.status}`);
  return new MapViewer(await answer.json());
}

// For scripts and tests: a promise of the viewer.
window.dynainsViewer = start().catch((error) => {
  fail(error);
  throw error;
});
