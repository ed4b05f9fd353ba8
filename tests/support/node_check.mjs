// For checks by node: packages of NODE_PATH, and failures.
import fs from "node:fs";
import { createRequire } from "node:module";

export const require = createRequire(import.meta.url); // NODE_PATH has an effect on require() only

/// Result of load(); without the packages, the check is skipped.
export async function packages(load) {
  try {
    return await load();
  } catch (error) {
    console.log("SKIPPED: " + error.message.split("\n")[0]);
    process.exit(0);
  }
}

/// Packages that read and write logs of ROS 2.
export const logPackages = () =>
  packages(() => ({
    core: require("@mcap/core"),
    rosmsg: require("@foxglove/rosmsg"),
    serialization: require("@foxglove/rosmsg2-serialization"),
  }));

export function expect(condition, message) {
  if (condition) return;
  console.log("FAILED: " + message);
  process.exit(1);
}

/// The indexed reader of @mcap/core (`core`) on a file. `decompressHandlers`: by name of compression.
export async function openMcap(core, file, decompressHandlers = {}) {
  const bytes = fs.readFileSync(file);
  return core.McapIndexedReader.Initialize({
    readable: {
      size: async () => BigInt(bytes.length),
      read: async (offset, length) =>
        new Uint8Array(bytes.subarray(Number(offset), Number(offset + length))),
    },
    decompressHandlers,
  });
}
