// node tiles_bench.mjs PROGRAM FOLDER
// Frames per second of the page of a served map in headless Chromium, without a graphics processor:
// a flight over the map, drawn for several numbers of points.
import {execFileSync} from 'node:child_process';
import {serveFolder} from '../viewer/static_server.mjs';
import {withPage} from '../viewer/browser.mjs';

const [program, folder] = process.argv.slice(2);
const kFrames = 20;
const kSize = {width: 1280, height: 720};

execFileSync(program, ['view', folder, '--tiles']);

// Draws a flight low over the map. Reading a pixel waits for the end of a frame.
async function fly(page, budget) {
  return page.evaluate(async (frames, points) => {
    const viewer = await window.dynainsViewer;
    const {state, tiles, renderer} = viewer;
    const pause = () => new Promise((resolve) => setTimeout(resolve, 30));
    state.budget = points;
    const place = (share) => {
      state.camera.target = [(2 * share - 1) * 0.8 * tiles.root.half[0], 0, 0];
      state.camera.distance = 120;
    };
    place(0);
    const begin = performance.now();
    do {
      viewer.draw();
      await pause();
    } while (!viewer.isComplete());
    const loading = performance.now() - begin;
    let drawing = 0;
    let shown = 0;
    let most = 0;
    for (let i = 0; i < frames; ++i) {
      place(i / frames);
      const start = performance.now();
      viewer.draw();
      renderer.gl.readPixels(0, 0, 1, 1, renderer.gl.RGBA, renderer.gl.UNSIGNED_BYTE, new Uint8Array(4));
      drawing += performance.now() - start;
      shown += viewer.shown.reduce((sum, tile) => sum + tile.points, 0) / frames;
      most = Math.max(most, tiles.loadedPoints());
      await pause();
    }
    return {loading, shown, most, rate: 1000 * frames / drawing};
  }, kFrames, budget);
}

console.log(`${kSize.width} x ${kSize.height} pixels`);
console.log('most points | s to load the first view | shown, mean | most loaded | frames per second');
const server = await serveFolder(folder);
await withPage(server.address + 'map.html', kSize, async (page) => {
  for (const budget of [250000, 500000, 1000000]) {
    const {loading, shown, most, rate} = await fly(page, budget);
    console.log([budget, (loading / 1000).toFixed(1), Math.round(shown), most, rate.toFixed(1)].join(' | '));
  }
});
server.close();
