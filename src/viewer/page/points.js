// Decodes the points of the page. Columns: see columns_of() in page.cpp.

async function inflated(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// counts: of the points of the map, and of moving ones, which follow. columns: x, y, z (in steps
// of `unit` m), scan, instance; intensity, belief, cause, flags.
async function decodePoints(base64, {counts, unit}) {
  const bytes = await inflated(base64);
  const total = counts[0] + counts[1];
  if (bytes.length !== 24 * total) throw new Error('the points of this page are damaged');
  const columns = [];
  for (let begin = 0; begin < 20 * total; begin += 4 * total) {
    const column = new Int32Array(total);
    const byte = (i, k) => bytes[begin + k * total + i] << 8 * k;
    let value = 0;
    for (let i = 0; i < total; ++i) {
      const code = byte(i, 0) | byte(i, 1) | byte(i, 2) | byte(i, 3);
      value += code >>> 1 ^ -(code & 1);
      column[i] = value;
    }
    columns.push(column);
  }
  for (let k = 20; k < 24; ++k) columns.push(bytes.slice(k * total, (k + 1) * total));
  return {total, counts, columns, unit};
}

// The values of point i.
function pointAt({columns, unit}, i) {
  const [x, y, z, scan, instance, , belief, cause, flags] = columns.map((column) => column[i]);
  return {local: [x * unit, y * unit, z * unit], scan, instance, belief: belief / 255, cause,
    label: flags & 3, truth: flags >> 2};
}

// What most heights lie between; at least 1 m apart.
function heightRange({columns, unit}) {
  const step = Math.max(1, Math.floor(columns[2].length / 20000));
  const heights = columns[2].filter((_, i) => i % step === 0).sort();
  const at = (share) => unit * (heights[Math.floor(share * (heights.length - 1))] ?? 0);
  return [at(0.02), Math.max(at(0.98), at(0.02) + 1)];
}
