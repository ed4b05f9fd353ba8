// State, input and the loop.

class Viewer {
  constructor(description, points) {
    this.description = description;
    this.points = points;
    const scans = description.scans;
    const [first, last] = [scans[0].position, scans[scans.length - 1].position];
    const yaw = Math.atan2(last[1] - first[1], last[0] - first[0]);
    this.state = {
      camera: new Camera(sum(first, [Math.cos(yaw), Math.sin(yaw), 0], 20), yaw, 40),
      scan: 0, allScans: true, heights: heightRange(points),
    };
    this.renderer = new Renderer(element('canvas'), points);
    this.isPlaying = false;
    this.fillTexts();
    this.connectPanel();
    this.connectMouse();
    this.connectTime();
    new ResizeObserver(() => this.request()).observe(element('canvas'));
    this.readPanel();
  }

  fillTexts() {
    document.title = this.description.title + ' - dynains';
    element('title').textContent = this.description.title;
    element('summary').textContent = summaryOf(this.description, this.points);
    this.description.causes.forEach((cause, number) => {
      if (cause.points === 0) return;
      const box = made('input', {type: 'checkbox', name: 'cause', checked: true, value: number});
      element('causes').append(made('label', {}, box, swatch(CAUSE_COLOURS[number]),
        `${cause.name} (${count(cause.points)})`));
    });
  }

  connectPanel() {
    element('panel').addEventListener('input', (event) => {
      if (event.target.value === 'follow') this.state.allScans = false;
      this.readPanel();
    });
    for (const [id, checked] of [['all-causes', true], ['no-causes', false]]) {
      element(id).addEventListener('click', () => {
        for (const box of document.querySelectorAll('#causes input')) box.checked = checked;
        this.readPanel();
      });
    }
    element('close').addEventListener('click', () => { element('card').hidden = true; });
  }

  // Takes what the controls of the panel say.
  readPanel() {
    const {state} = this;
    const panel = new FormData(element('panel'));
    for (const name of ['colour', 'size', 'shading']) state[name] = Number(panel.get(name));
    state.split = panel.get('split') / 100;
    state.camera.mode = panel.get('camera');
    state.causes = panel.getAll('cause').reduce((bits, cause) => bits | 1 << cause, 0) >>> 0;
    this.update();
  }

  connectMouse() {
    const canvas = element('canvas');
    connectCamera(canvas, this.state.camera, () => this.request(), (x, y) => this.pick(x, y));
    const divider = element('divider');
    divider.addEventListener('pointerdown', (event) => divider.setPointerCapture(event.pointerId));
    divider.addEventListener('pointermove', (event) => {
      if (!divider.hasPointerCapture(event.pointerId)) return;
      this.state.split = Math.min(1, Math.max(0, event.clientX / canvas.clientWidth));
      this.update();
    });
  }

  connectTime() {
    const bar = element('scan');
    bar.max = this.description.scans.length - 1;
    bar.addEventListener('input', () => {
      this.state.scan = Number(bar.value);
      this.state.allScans = false;
      this.update();
    });
    element('all-scans').addEventListener('input', (event) => {
      this.state.allScans = event.target.checked;
      if (event.target.checked) this.isPlaying = false;
      this.update();
    });
    element('play').addEventListener('click', () => {
      this.isPlaying = !this.isPlaying;
      if (this.isPlaying) this.state.allScans = false;
      this.update();
      if (this.isPlaying) this.play();
    });
  }

  // Each scan is shown for the time to the next one, at most half a second.
  play() {
    const {scans} = this.description;
    const next = (this.state.scan + 1) % scans.length;
    const pause = next === 0 ? 0.5 : scans[next].time - scans[this.state.scan].time;
    setTimeout(() => {
      if (!this.isPlaying) return;
      this.state.scan = next;
      this.update();
      this.play();
    }, 1000 * Math.min(0.5, Math.max(0.02, pause)));
  }

  pick(x, y) {
    const index = this.renderer.pick(this.state, x, y);
    if (index < 0) {
      element('card').hidden = true;
    } else {
      showCard(factsOf(this.description, this.points, index));
    }
    this.request();
    return index;
  }

  // Brings all controls into line with the state.
  update() {
    const {state} = this;
    const {scans} = this.description;
    if (state.camera.mode === 'follow') state.camera.follow(scans, state.scan);
    element('split').value = 100 * state.split;
    for (const id of ['divider', 'before', 'after']) {
      element(id).style.left = 100 * state.split + '%';
    }
    element('scan').value = state.scan;
    element('all-scans').checked = state.allScans;
    element('play').textContent = this.isPlaying ? 'pause' : 'play';
    const scan = scans[state.scan];
    element('scan-name').textContent =
      state.allScans ? 'all scans' : `scan ${scan.name} (${scan.time.toFixed(2)} s)`;
    element('legend').replaceChildren(...legendOf(state.colour, this.description));
    this.request();
  }

  request() {
    if (this.requested) return;
    this.requested = true;
    requestAnimationFrame(() => {
      this.requested = false;
      this.renderer.draw(this.state);
    });
  }
}

async function start() {
  const description = JSON.parse(element('description').textContent);
  const points = await decodePoints(element('points').textContent, description.packing);
  element('points').remove();
  return new Viewer(description, points);
}

// For scripts and tests: a promise of the viewer.
window.dynainsViewer = start().catch((error) => {
  element('failure').textContent = error.message;
  element('failure').hidden = false;
  throw error;
});
