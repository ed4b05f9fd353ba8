// node map_test.mjs PROGRAM FOLDER
// Writes the map of a simulated street in tiles, and shows it in a browser from a static server.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {existsSync, mkdirSync, readdirSync, readFileSync, statSync} from 'node:fs';
import {withPage, set} from './browser.mjs';
import {serveFolder} from './static_server.mjs';

const [program, folder] = process.argv.slice(2);
const out = `${folder}/cleaned`;

function makeRun() {
  mkdirSync(folder, {recursive: true});
  const dynains = (...words) => execFileSync(program, words, {cwd: folder, stdio: 'pipe'});
  dynains('simulate', 'street', '--force', '-q', '--scans', '120');
  dynains('run', 'street', '--out', 'cleaned', '--force', '-q', '--map-attributes');
}

function plyCount(file) {
  const header = readFileSync(file).subarray(0, 1000).toString('latin1');
  return Number(/element vertex +(\d+)/.exec(header)[1]);
}

// POINTS_LENGTH of a tile file.
function tileCount(uri) {
  const bytes = readFileSync(`${out}/${uri}`);
  const features = bytes.subarray(28, 28 + bytes.readUInt32LE(12)).toString();
  return JSON.parse(features).POINTS_LENGTH;
}

function testTileset() {
  const tileset = JSON.parse(readFileSync(`${out}/tileset.json`));
  let points = 0;
  const uris = [];
  const visit = (tile) => {
    assert.equal(tileCount(tile.content.uri), tile.extras.points);
    points += tile.extras.points;
    uris.push(tile.content.uri.replace('tileset/', ''));
    (tile.children ?? []).forEach(visit);
  };
  visit(tileset.root);
  assert.equal(points, plyCount(`${out}/static_map.ply`), 'each map point is in one tile');
  assert.deepEqual(uris.sort(), readdirSync(`${out}/tileset`).sort());
}

// Draws until all tiles of this view are there, and describes them.
async function settled(page) {
  await page.evaluate(async () => { (await window.dynainsViewer).request(); });
  await page.waitForFunction(async () => (await window.dynainsViewer).isComplete(), {timeout: 60000});
  return page.evaluate(async () => {
    const {tiles, shown} = await window.dynainsViewer;
    return {
      shown: shown.map((tile) => tile.uri),
      loaded: [...tiles.loaded].map((tile) => tile.uri),
      points: tiles.loadedPoints(),
      root: tiles.root.content?.total,
      total: tiles.total,
    };
  });
}

// The camera of the page looks at a place (shares of the size of the map) from a distance, m.
async function look(page, east, north, distance) {
  await page.evaluate(async (x, y, metres) => {
    const {state, tiles} = await window.dynainsViewer;
    state.camera.target = [x * tiles.root.half[0], y * tiles.root.half[1], -tiles.root.half[2]];
    state.camera.distance = metres;
  }, east, north, distance);
  return settled(page);
}

const depth = (uris) => Math.max(...uris.map((uri) => uri.length));

async function shareOfPoints(page) {
  return page.evaluate(async () => {
    const viewer = await window.dynainsViewer;
    viewer.draw();
    const {gl, canvas} = viewer.renderer;
    const pixels = new Uint8Array(4 * canvas.width * canvas.height);
    gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    let drawn = 0;
    for (let i = 0; i < pixels.length; i += 4) drawn += pixels[i] !== 18 || pixels[i + 1] !== 22;
    return drawn / (pixels.length / 4);
  });
}

async function testTiles(page) {
  const far = await look(page, 0, 0, 3000);
  assert.equal(far.root, tileCount('tileset/r.pnts'), 'the root tile is loaded as its file has it');
  assert.equal(far.total, plyCount(`${out}/static_map.ply`));
  assert.ok(far.shown.length < 6, `few tiles are shown from far: ${far.shown}`);

  const near = await look(page, -0.8, 0, 25);
  assert.ok(depth(near.shown) > depth(far.shown), `near: finer tiles, ${near.shown}`);
  const finer = near.shown.filter((uri) => !far.loaded.includes(uri));
  assert.ok(finer.length > 0);
  for (const uri of far.shown) assert.ok(near.loaded.includes(uri), 'coarse tiles stay below finer ones');
  await look(page, 0, 0, 100);
  const share = await shareOfPoints(page);
  assert.ok(share > 0.2, `points cover ${share} of the picture`);

  // A budget of 100,000 points: at the other end, tiles of this end are freed.
  await set(page, '#budget', 0.1);
  const here = await look(page, -0.8, 0, 25);
  assert.ok(here.points <= 100000, `${here.points} points are loaded`);
  const there = await look(page, 0.8, 0, 25);
  assert.ok(there.points <= 100000, `${there.points} points are loaded`);
  const freed = here.shown.filter((uri) => !there.loaded.includes(uri));
  assert.ok(freed.length > 0, 'far tiles were freed');
  const back = await look(page, -0.8, 0, 25);
  assert.deepEqual(back.shown.sort(), here.shown.sort(), 'the same view has the same tiles');
  const summary = await page.$eval('#summary', (node) => node.textContent);
  assert.ok(summary.startsWith(`${far.total.toLocaleString('en-US')} points. Shown: `), summary);
}

async function testControls(page) {
  const before = await page.evaluate(async () => {
    const {camera} = (await window.dynainsViewer).state;
    return [camera.yaw, camera.distance];
  });
  await page.mouse.move(500, 300);
  await page.mouse.down();
  await page.mouse.move(560, 320, {steps: 3});
  await page.mouse.up();
  await page.mouse.wheel({deltaY: 300});
  await settled(page);
  const after = await page.evaluate(async () => {
    const {camera} = (await window.dynainsViewer).state;
    return [camera.yaw, camera.distance];
  });
  assert.notEqual(after[0], before[0]);
  assert.ok(after[1] > before[1]);
  const colours = await page.$$eval('#colour option', (options) => options.map((o) => o.textContent));
  assert.deepEqual(colours, ['height', 'intensity', 'label'], 'the colours that the map has');
}

makeRun();
execFileSync(program, ['view', out, '--tiles', '-q']);
testTileset();
const server = await serveFolder(out);
// The browser asks for the icon of a page by itself; the server has none.
await withPage(server.address + 'map.html', {width: 720, height: 450}, async (page, complaints) => {
  await settled(page);
  await testTiles(page);
  await testControls(page);
  assert.deepEqual(complaints, [], 'the console is empty, and nothing else is requested');
  // The page tells when the server is gone.
  await server.close();
  await look(page, 0.8, 0.2, 10).catch(() => {});
  assert.equal(await page.$eval('#failure', (node) => node.hidden), false);
});
// The tiles are used again; a run with --force removes them.
const written = statSync(`${out}/tileset.json`).mtimeMs;
execFileSync(program, ['view', out, '--tiles', '-q']);
assert.equal(statSync(`${out}/tileset.json`).mtimeMs, written);
execFileSync(program, ['run', 'street', '--out', 'cleaned', '--force', '-q'], {cwd: folder});
for (const name of ['tileset.json', 'tileset', 'map.html']) assert.ok(!existsSync(`${out}/${name}`), name);
console.log('the browser shows the map in tiles');
