// node check_las.mjs MAP.las MAP.ply WKT: @loaders.gl/las reads from a map of LAS the points of the PLY
// (float x y z intensity, uint label), in its order.
import fs from "node:fs";
import path from "node:path";
import { pathToFileURL } from "node:url";

import { expect, packages, require } from "../support/node_check.mjs";

const { core, las } = await packages(async () => {
  const folder = path.dirname(require.resolve("@loaders.gl/las"));
  return {
    core: require("@loaders.gl/core"),
    las: await import(pathToFileURL(path.join(folder, "index.js"))),
  };
});

// The reader of version 1.4 fetches its own WebAssembly, which is a file here.
globalThis.fetch = async (url) =>
  new Response(fs.readFileSync(url), { headers: { "Content-Type": "application/wasm" } });

const [lasFile, plyFile, crs] = process.argv.slice(2);
const bytes = fs.readFileSync(lasFile);
const data = await core.parse(
  bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length),
  las.LAZRsLoader,
  { worker: false, las: { fp64: true, shape: "mesh" } },
);
const header = data.loaderData;
expect(header.versionAsString === "1.4" && header.pointsFormatId === 6, "LAS 1.4, format 6");

const ply = fs.readFileSync(plyFile);
const end = ply.indexOf("end_header\n") + "end_header\n".length;
const names = [...ply.toString("latin1", 0, end).matchAll(/^property \w+ (\w+)$/gm)].map((m) => m[1]);
expect(names.join(" ") === "x y z intensity label", "columns of the PLY: " + names);
const count = (ply.length - end) / 20;
const { POSITION, intensity, classification } = data.attributes;
expect(count > 1000 && POSITION.value.length === 3 * count, "number of points");
const classes = new Set();
const labels = new Set();
for (let i = 0; i < count; ++i) {
  const at = end + 20 * i;
  for (let axis = 0; axis < 3; ++axis) {
    const value = ply.readFloatLE(at + 4 * axis);
    const found = POSITION.value[3 * i + axis];
    expect(Math.abs(found - value) < 0.00052, `point ${i}: ${value}, found ${found}`);
    expect(found >= header.mins[axis] - 1e-9 && found <= header.maxs[axis] + 1e-9, "limits");
  }
  const brightness = Math.round(65535 * ply.readFloatLE(at + 12));
  expect(intensity.value[i] === brightness, `point ${i}: intensity ${intensity.value[i]}`);
  classes.add(classification.value[i]);
  labels.add(ply.readUInt32LE(at + 16));
}
expect([...classes].sort().join() === "1,2", "classes " + [...classes]);
expect(labels.size > 3, "labels of the recording in the PLY");

// Extra bytes and reference system, which the reader skips.
const describe = (name) => bytes.indexOf(name + "\0") > 0;
expect(["belief", "cause", "instance"].every(describe), "extra bytes");
expect(header.pointsStructSize === 39, "size of a point");
for (let i = 0; i < count; ++i) {
  const point = header.pointsOffset + 39 * i;
  const [time, belief] = [bytes.readDoubleLE(point + 22), bytes.readFloatLE(point + 30)];
  const cause = bytes.readUInt8(point + 34);
  expect(time >= 0 && time < 10 && belief >= 0 && belief <= 1, `point ${i}: time, belief`);
  expect((cause === 1) === (classification.value[i] === 2), `point ${i}: ground by its cause`);
}
expect(bytes.indexOf(crs) > 0, "reference system");
console.log(`${count} points are equal`);
