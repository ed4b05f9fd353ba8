// node notebook.mjs PYTHON FOLDER: what a notebook shows of dynains.view() is the page, in a real
// browser. Skipped without one, see tests/viewer.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdirSync} from 'node:fs';
import {withPage} from '../viewer/browser.mjs';

const [python, folder] = process.argv.slice(2);
mkdirSync(folder, {recursive: true});
const street = ['street', '--force', '-q', '--scene', 'static', '--sensor', 'vlp16', '--scans', '5'];
execFileSync(`${process.env.DYNAINS_PROGRAM}_simulate`, street, {cwd: folder, stdio: 'inherit'});
execFileSync(python, ['-B', '-c', `
import dynains
result = dynains.run("street", "cleaned", force=True)
page = dynains.view(result, height=333)
with open("notebook.html", "w") as notebook:
    notebook.write("<!doctype html><p>a cell</p>" + page._repr_html_())
`], {cwd: folder, stdio: 'inherit'});
await withPage(`file://${folder}/notebook.html`, {width: 600, height: 500}, async (page, complaints) => {
  const node = await page.$('iframe');
  assert.equal((await node.boundingBox()).height, 333);
  const frame = await node.contentFrame();
  const shown = await frame.evaluate(async () => {
    const {points, description} = await window.dynainsViewer;
    return [points.total, description.counts.moving, description.scans.length];
  });
  assert.ok(shown[0] > 1000 && shown[0] >= shown[1], shown);
  assert.equal(shown[2], 5);
  assert.deepEqual(complaints.filter((text) => text !== 'request about:srcdoc'), []);
});
console.log('a notebook shows the page');
