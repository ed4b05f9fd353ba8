// Opens pages of `dynains view` in headless Chromium. Needs npm puppeteer-core below NODE_PATH and
// a program chromium; NODE_PATH holds for require() only.
import {createRequire} from 'node:module';
import {existsSync} from 'node:fs';

function skip(reason) {
  console.log(`SKIPPED: ${reason}`);
  process.exit(0);
}

function findPuppeteer() {
  try {
    return createRequire(import.meta.url)('puppeteer-core');
  } catch {
    return skip('no puppeteer-core (npm) below NODE_PATH');
  }
}

const chromium = ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome']
  .find((path) => existsSync(path)) ?? skip('no chromium');
const puppeteer = findPuppeteer();

// Calls work(page, complaints) with the loaded page of an address; complaints are messages of its
// console and requests that leave the file or the server.
export async function withPage(address, size, work) {
  const browser = await puppeteer.launch({
    executablePath: chromium, headless: true, protocolTimeout: 300000,
    args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
      '--ignore-gpu-blocklist'],
  });
  try {
    const page = await browser.newPage();
    const complaints = [];
    page.on('console', (message) => {
      // Chromium warns that readPixels(), which these tests call, is slow.
      if (!/GPU stall due to ReadPixels/.test(message.text())) complaints.push(message.text());
    });
    page.on('pageerror', (error) => complaints.push(error.message));
    page.on('request', (request) => {
      const isOwn = /^(data|blob):/.test(request.url()) ||
        request.url().startsWith(address.startsWith('file:') ? 'file:' : new URL('.', address).href);
      if (!isOwn) complaints.push(`request ${request.url()}`);
    });
    await page.setViewport(size);
    await page.goto(address, {timeout: 120000});
    await page.evaluate(async () => { await window.dynainsViewer; });
    await work(page, complaints);
  } finally {
    await browser.close();
  }
}

// Sets a control as a user does.
export async function set(page, selector, value) {
  await page.$eval(selector, (control, v) => {
    if (control.type === 'checkbox' || control.type === 'radio') control.checked = v;
    else control.value = v;
    control.dispatchEvent(new Event('input', {bubbles: true}));
  }, value);
}

// Draws now, and returns for each cell of a grid (rows from the top) the share of pixels that are
// background, grey or coloured.
export async function regions(page, columns, rows) {
  return page.evaluate(async (columnCount, rowCount) => {
    const {renderer, state} = await window.dynainsViewer;
    renderer.draw(state);
    const {gl, canvas} = renderer;
    const {width, height} = canvas;
    const pixels = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    const cells = Array.from({length: columnCount * rowCount}, () => [0, 0, 0, 0]);
    for (let y = 0; y < height; ++y) {
      const row = Math.floor((height - 1 - y) * rowCount / height);
      for (let x = 0; x < width; ++x) {
        const [r, g, b] = pixels.subarray(4 * (y * width + x), 4 * (y * width + x) + 3);
        const isBackground = r === 18 && g === 22 && b === 28;
        const isGrey = Math.max(r, g, b) - Math.min(r, g, b) < 12;
        const cell = cells[row * columnCount + Math.floor(x * columnCount / width)];
        ++cell[isBackground ? 0 : isGrey ? 1 : 2];
        ++cell[3];
      }
    }
    return cells.map(([background, grey, coloured, all]) =>
      [background, grey, coloured].map((value) => Number((value / all).toFixed(3))));
  }, columns, rows);
}
