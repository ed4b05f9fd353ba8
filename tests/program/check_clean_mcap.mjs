// node check_clean_mcap.mjs LOG.mcap COPY.mcap LABELS: by @mcap/core, the copy that `dynains run
// --write-log` made has the same schemas, channels and messages, and clouds without the points that
// are moving by the files in the folder LABELS.
import assert from "node:assert";
import { execFileSync } from "node:child_process";
import fs from "node:fs";

import { logPackages, openMcap } from "../support/node_check.mjs";

const { core, rosmsg, serialization } = await logPackages();

const [log, copy, folder] = process.argv.slice(2);

const decompress = (command) => (data) =>
  execFileSync(command, ["-d", "-c", "-q"], { input: data, maxBuffer: 1 << 28 });

async function all(messages) {
  const result = [];
  for await (const message of messages) result.push(message);
  return result;
}

const handlers = { lz4: decompress("lz4"), zstd: decompress("zstd") };
const a = await openMcap(core, log, handlers);
const b = await openMcap(core, copy, handlers);
assert.strictEqual(b.header.profile, a.header.profile);
assert.strictEqual(b.statistics.messageCount, a.statistics.messageCount);
// Ids may differ.
function channel(reader, id) {
  const { id: ignored, schemaId, ...rest } = reader.channelsById.get(id);
  const { id: alsoIgnored, ...schema } = reader.schemasById.get(schemaId);
  return { ...rest, schema };
}
const before = await all(a.readMessages());
const after = await all(b.readMessages());
assert.strictEqual(after.length, before.length);

const labels = fs.readdirSync(folder).sort();
let moving = 0;
for (let i = 0; i < before.length; ++i) {
  const { data, channelId, ...head } = before[i];
  const { data: cleanData, channelId: cleanId, ...cleanHead } = after[i];
  assert.deepStrictEqual(cleanHead, head);
  const { schema } = channel(a, channelId);
  assert.deepStrictEqual(channel(b, cleanId), channel(a, channelId));
  if (schema.name !== "sensor_msgs/msg/PointCloud2") {
    assert.ok(Buffer.from(data).equals(Buffer.from(cleanData)));
    continue;
  }
  const definitions = rosmsg.parse(new TextDecoder().decode(schema.data), { ros2: true });
  const reader = new serialization.MessageReader(definitions);
  const cloud = reader.readMessage(data);
  const clean = reader.readMessage(cleanData);
  const file = fs.readFileSync(`${folder}/${labels.shift()}`);
  const kept = [];
  for (let k = 0; k < cloud.width * cloud.height; ++k) {
    if (file.readUInt16LE(4 * k) === 251) continue;
    kept.push(Buffer.from(cloud.data.slice(k * cloud.point_step, (k + 1) * cloud.point_step)));
  }
  moving += cloud.width - kept.length;
  assert.ok(Buffer.concat(kept).equals(Buffer.from(clean.data)));
  assert.deepStrictEqual(
    { ...clean, data: null },
    {
      ...cloud,
      data: null,
      height: 1,
      width: kept.length,
      row_step: kept.length * cloud.point_step,
    },
  );
}
assert.ok(moving > 0 && labels.length === 0);
console.log(`the copy lacks ${moving} moving points and is equal`);
