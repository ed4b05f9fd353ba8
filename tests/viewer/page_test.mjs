// node page_test.mjs PROGRAM FOLDER DESCRIPTION [--describe]
// Shows the README's street in a browser. DESCRIPTION holds the colours by region of its picture;
// --describe writes it.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdirSync, readFileSync, statSync, writeFileSync} from 'node:fs';
import {regions, set, withPage} from './browser.mjs';

const [program, folder, descriptionFile, mode] = process.argv.slice(2);
const kColumns = 6;
const kRows = 4;
const kPoints = 150000;

function makePage() {
  mkdirSync(folder, {recursive: true});
  const dynains = (...words) => execFileSync(program, words, {cwd: folder, stdio: 'pipe'}).toString();
  execFileSync(`${program}_simulate`, ['street', '--force', '-q'], {cwd: folder, stdio: 'pipe'});
  const text = dynains('run', 'street', '--out', 'cleaned', '--force', '--view');
  assert.match(text, /page: cleaned\/view\.html\n$/, 'the run ends with the path of the page');
  assert.ok(statSync(`${folder}/cleaned/view.html`).size < 15e6, 'the page has less than 15 MB');
  // Without a graphics processor, fewer points are drawn sooner.
  const again = dynains('view', 'cleaned', '--max-points', String(kPoints));
  assert.equal(again, 'page: cleaned/view.html\n');
  return `${folder}/cleaned`;
}

const digits = (number) => number.toLocaleString('en-US');

async function testCounts(page, out) {
  const report = JSON.parse(readFileSync(`${out}/report.json`));
  const moving = report.labels.dynamic;
  const summary = await page.$eval('#summary', (node) => node.textContent);
  const shown = await page.evaluate(async () => {
    const {points} = await window.dynainsViewer;
    return points.counts;
  });
  const all = shown[0] + shown[1];
  assert.ok(shown[1] <= moving && all <= kPoints && all > 0.5 * kPoints, `${shown} points`);
  assert.ok(summary.startsWith(`${report.scans} scans, ${digits(report.points)} points.`), summary);
  assert.ok(summary.includes(`${digits(shown[0])} static points`), summary);
  assert.ok(summary.includes(`${digits(shown[1])} of ${digits(moving)} removed points`), summary);
}

const coloured = (cells) => cells.reduce((sum, cell) => sum + cell[2], 0) / cells.length;

async function testSlider(page) {
  await set(page, '#split', 100);
  const before = coloured(await regions(page, 1, 1));
  await set(page, '#split', 0);
  const after = coloured(await regions(page, 1, 1));
  assert.ok(before > 0.04, `before: ${before} of the pixels are of moving points`);
  assert.equal(after, 0, 'after: no moving points');
  await set(page, '#split', 50);
}

async function testFilter(page) {
  await set(page, '#split', 100);
  await page.$eval('#no-causes', (button) => button.click());
  const [none] = await regions(page, 1, 1);
  assert.deepEqual(none, [1, 0, 0], 'nothing is shown without causes');
  await set(page, '#causes input[value="1"]', true);
  const [ground] = await regions(page, 1, 1);
  assert.ok(ground[1] > 0.05 && ground[2] === 0, `ground alone is grey: ${ground}`);
  await page.$eval('#all-causes', (button) => button.click());
  await set(page, '#split', 50);
}

async function facts(page) {
  return page.$$eval('#card dl > *', (nodes) => {
    const texts = nodes.map((node) => node.textContent);
    return Object.fromEntries(texts.flatMap((t, i) => (i % 2 ? [] : [[t, texts[i + 1]]])));
  });
}

// Position of a pixel of a moving instance that no control covers, in pixels of the page.
async function movingPixel(page) {
  return page.evaluate(async () => {
    const {renderer, state} = await window.dynainsViewer;
    renderer.draw(state);
    const {gl, canvas} = renderer;
    const pixel = new Uint8Array(4);
    for (let y = canvas.height * 0.4; y < canvas.height; y += 3) {
      for (let x = canvas.width * 0.45; x > canvas.width * 0.3; x -= 3) {
        if (document.elementFromPoint(x, y) !== canvas) continue;
        gl.readPixels(x, canvas.height - 1 - y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
        if (Math.max(...pixel.slice(0, 3)) - Math.min(...pixel.slice(0, 3)) > 100) return [x, y];
      }
    }
    return null;
  });
}

async function testPicking(page, out) {
  const [x, y] = await movingPixel(page);
  await page.mouse.click(x, y);
  const moving = await facts(page);
  assert.equal(moving.label, 'moving');
  assert.match(moving.cause, /seen free$|instance|track|presumed|occupancy|came or went/);
  assert.match(moving['ground truth'], /^(moving: right|static: lost static point)$/);
  assert.ok(Number(moving.belief) >= 0.5, moving.belief);
  // The files of the run have this verdict.
  const name = moving.scan.split(' ')[0];
  const bytes = readFileSync(`${out}/labels/${name}.label`);
  const words = new Uint32Array(bytes.buffer, bytes.byteOffset, bytes.length / 4);
  const instance = moving.instance === 'none' ? 0 : Number(moving.instance);
  assert.ok(words.includes((251 | instance << 16) >>> 0), 'the label file has this instance');

  // On the other side of the divider this place has no moving point.
  await set(page, '#split', 0);
  await page.mouse.click(x, y);
  const hasCard = await page.$eval('#card', (card) => !card.hidden);
  if (hasCard) {
    const kept = await facts(page);
    assert.equal(kept.label, 'static');
  }
  await set(page, '#split', 50);
  // The sky has no point.
  await page.mouse.click(400, 8);
  assert.equal(await page.$eval('#card', (card) => card.hidden), true);
}

async function testTime(page) {
  await set(page, '#split', 100);
  const all = coloured(await regions(page, 1, 1));
  await set(page, '#scan', 40);
  assert.match(await page.$eval('#scan-name', (node) => node.textContent), /^scan 000040 \(4\.00 s\)$/);
  const one = coloured(await regions(page, 1, 1));
  assert.ok(one > 0 && one < 0.5 * all, `scan 40 alone: ${one} of ${all}`);
  await set(page, '#all-scans', true);
  await set(page, '#split', 50);
}

// Errors have colours of their own.
async function testErrors(page) {
  await set(page, '#colour', 6);
  const [errors] = await regions(page, 1, 1);
  await set(page, '#colour', 0);
  const [instances] = await regions(page, 1, 1);
  assert.notDeepEqual(errors, instances);
  assert.ok(errors[2] > 0.01, `removed and wrong points are coloured: ${errors}`);
}

async function testPicture(page) {
  const seen = await regions(page, kColumns, kRows);
  if (mode === '--describe') {
    writeFileSync(descriptionFile, JSON.stringify(
      {columns: kColumns, rows: kRows, shares: ['background', 'grey', 'coloured'], cells: seen})
      .replaceAll('],[', '],\n[') + '\n');
  }
  const {cells} = JSON.parse(readFileSync(descriptionFile));
  cells.forEach((expected, i) => expected.forEach((share, k) => {
    assert.ok(Math.abs(share - seen[i][k]) < 0.04,
      `region ${i}: ${seen[i]} instead of ${expected} (background, grey, coloured)`);
  }));
}

const out = makePage();
await withPage(`file://${out}/view.html`, {width: 720, height: 450}, async (page, complaints) => {
  await testCounts(page, out);
  await testPicture(page);
  await testSlider(page);
  await testFilter(page);
  await testPicking(page, out);
  await testTime(page);
  await testErrors(page);
  assert.deepEqual(complaints, [], 'the console is empty, and nothing is requested');
});
console.log('the page shows the street');
