// node rewrite_mcap.mjs IN.mcap OUT.mcap COMPRESSION: reads a log by @mcap/core, decodes and encodes
// every message by @foxglove/rosmsg2-serialization, and writes the log in chunks. The command
// COMPRESSION (lz4 or zstd) compresses each chunk.
import { execFileSync } from "node:child_process";
import fs from "node:fs";

import { logPackages, openMcap } from "../support/node_check.mjs";

const { core, rosmsg, serialization } = await logPackages();

const [input, output, compression] = process.argv.slice(2);

const reader = await openMcap(core, input);

const file = fs.openSync(output, "w");
let position = 0;
const writer = new core.McapWriter({
  writable: {
    write: async (part) => {
      fs.writeSync(file, part);
      position += part.length;
    },
    position: () => BigInt(position),
  },
  chunkSize: 500000,
  compressChunk: (data) => ({
    compression,
    compressedData: execFileSync(compression, ["-c", "-q"], { input: data, maxBuffer: 1 << 28 }),
  }),
});
await writer.start({ profile: "ros2", library: "rewrite_mcap" });

const channels = new Map();
for (const [id, channel] of reader.channelsById) {
  const schema = reader.schemasById.get(channel.schemaId);
  const definitions = rosmsg.parse(new TextDecoder().decode(schema.data), { ros2: true });
  channels.set(id, {
    id: await writer.registerChannel({
      ...channel,
      schemaId: await writer.registerSchema(schema),
    }),
    reader: new serialization.MessageReader(definitions),
    writer: new serialization.MessageWriter(definitions),
  });
}
for await (const message of reader.readMessages()) {
  const channel = channels.get(message.channelId);
  await writer.addMessage({
    ...message,
    channelId: channel.id,
    data: channel.writer.writeMessage(channel.reader.readMessage(message.data)),
  });
}
await writer.end();
fs.closeSync(file);
