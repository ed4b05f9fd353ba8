// node check_verdicts.mjs OUT: @mcap/core and @foxglove/rosmsg2-serialization read from
// OUT/verdicts.mcap the labels and causes of OUT, poses, and the points of OUT/static_map.ply.
import fs from "node:fs";

import { expect, openMcap, packages, require } from "../support/node_check.mjs";

const { core, rosmsg, serialization } = await packages(() => ({
  core: require("@mcap/core"),
  rosmsg: require("@foxglove/rosmsg"),
  serialization: require("@foxglove/rosmsg2-serialization"),
}));

const [out] = process.argv.slice(2);
const reader = await openMcap(core, `${out}/verdicts.mcap`);
const readers = new Map();
for (const [id, channel] of reader.channelsById) {
  const schema = reader.schemasById.get(channel.schemaId);
  const definitions = rosmsg.parse(new TextDecoder().decode(schema.data), { ros2: true });
  readers.set(id, [channel.topic, new serialization.MessageReader(definitions)]);
}

const names = fs.readdirSync(`${out}/labels`).sort().map((name) => name.split(".")[0]);
const ply = fs.readFileSync(`${out}/static_map.ply`);
const plyBegin = ply.indexOf("end_header\n") + "end_header\n".length;
let [scans, transforms, mapBytes] = [0, 0, 0];
const fieldsOf = (cloud) => cloud.fields.map((field) => field.name).join(" ");
for await (const message of reader.readMessages()) {
  const [topic, decoder] = readers.get(message.channelId);
  const content = decoder.readMessage(message.data);
  if (topic === "/tf") {
    const { header, child_frame_id, transform } = content.transforms[0];
    expect(header.frame_id === "map" && child_frame_id === "lidar", "frames of a transform");
    const { x, y, z, w } = transform.rotation;
    expect(Math.abs(Math.hypot(x, y, z, w) - 1) < 1e-9, "length of a rotation");
    ++transforms;
    continue;
  }
  const data = Buffer.from(content.data.buffer, content.data.byteOffset, content.data.length);
  expect(content.width * content.point_step === data.length, "size of a cloud");
  if (topic === "/static_map") {
    expect(content.header.frame_id === "map" && fieldsOf(content) === "x y z", "the map");
    const expected = ply.subarray(plyBegin + mapBytes, plyBegin + mapBytes + data.length);
    expect(data.equals(expected), "points of the map");
    mapBytes += data.length;
    continue;
  }
  const name = names[scans++];
  const fields = fieldsOf(content);
  expect(content.header.frame_id === "lidar", "frame of a cloud");
  expect(fields === "x y z intensity label instance belief cause", "fields: " + fields);
  const labels = fs.readFileSync(`${out}/labels/${name}.label`);
  const causes = fs.readFileSync(`${out}/causes/${name}.cause`);
  expect(content.width === causes.length, "number of points of " + name);
  for (let i = 0; i < content.width; ++i) {
    const at = i * content.point_step;
    const [label, instance] = [data.readUInt16LE(at + 16), data.readUInt32LE(at + 18)];
    const short = instance === 0 ? 0 : ((instance - 1) % 65535) + 1;
    expect(labels.readUInt16LE(4 * i) === label, `label of point ${i} of ${name}`);
    expect(labels.readUInt16LE(4 * i + 2) === short, `instance of point ${i} of ${name}`);
    const belief = data.readFloatLE(at + 22);
    expect(belief >= 0 && belief <= 1, `belief of point ${i} of ${name}`);
    expect(causes[i] === data[at + 26], `cause of point ${i} of ${name}`);
  }
}
expect(scans === names.length && transforms === scans && scans > 0, "number of scans");
expect(plyBegin + mapBytes === ply.length, "the whole map");
console.log(scans + " scans are equal");
