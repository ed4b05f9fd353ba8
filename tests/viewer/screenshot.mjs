// node screenshot.mjs PAGE PICTURE: the picture of the README.
import {set, withPage} from './browser.mjs';

const [file, picture] = process.argv.slice(2);
await withPage(`file://${file}`, {width: 1280, height: 640}, async (page) => {
  await set(page, '#size', 1.5);
  await page.evaluate(async () => {
    const {renderer, state} = await window.dynainsViewer;
    renderer.draw(state);
  });
  await page.screenshot({path: picture});
});
