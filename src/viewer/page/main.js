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
      split: 0.5, colour: 0, size: 1.5, shading: 0.7, scan: 0, allScans: true,
      causes: 0xffffffff, heights: heightRange(points),
    };
    this.renderer = new Renderer(element('canvas'), points);
    this.isPlaying = false;
    this.fillTexts();
    this.connectPanel();
    this.connectMouse();
    this.connectTime();
    new ResizeObserver(() => this.request()).observe(element('canvas'));
    this.update();
  }

  fillTexts() {
    document.title = this.description.title + ' - dynains';
    element('title').textContent = this.description.title;
    element('summary').textContent = summaryOf(this.description, this.points);
    this.description.causes.forEach((cause, number) => {
      if (cause.points === 0) return;
      const label = document.createElement('label');
      const box = document.createElement('input');
      box.type = 'checkbox';
      box.checked = true;
      box.value = number;
      label.append(box, swatch(CAUSE_COLOURS[number]), `${cause.name} (${count(cause.points)})`);
      element('causes').append(label);
    });
  }

  connectPanel() {
    const number = (id, name, scale = 1) => element(id).addEventListener('input', (event) => {
      this.state[name] = Number(event.target.value) * scale;
      this.update();
    });
    number('split', 'split', 0.01);
    number('colour', 'colour');
    number('size', 'size');
    number('shading', 'shading');
    for (const box of document.querySelectorAll('input[name=camera]')) {
      box.addEventListener('input', () => {
        this.state.camera.mode = box.value;
        if (box.value === 'follow') this.state.allScans = false;
        this.update();
      });
    }
    const causeBoxes = [...document.querySelectorAll('#causes input')];
    const readCauses = () => {
      this.state.causes = causeBoxes.reduce(
        (bits, box) => box.checked ? bits : bits & ~(1 << Number(box.value)), ~0) >>> 0;
      this.update();
    };
    element('causes').addEventListener('input', readCauses);
    for (const [id, checked] of [['all-causes', true], ['no-causes', false]]) {
      element(id).addEventListener('click', () => {
        for (const box of causeBoxes) box.checked = checked;
        readCauses();
      });
    }
    element('close').addEventListener('click', () => { element('card').hidden = true; });
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

  // Name and text of everything that is known of a point.
  factsOf(index) {
    return factsOf(this.description, this.points, index);
  }

  pick(x, y) {
    const index = this.renderer.pick(this.state, x, y);
    if (index < 0) {
      element('card').hidden = true;
    } else {
      showCard(this.factsOf(index));
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
