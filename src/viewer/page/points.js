// Decodes the points of the page. Columns: see PackedPoints in page.cpp.

const VERTEX_BYTES = 16;

async function inflated(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Vertices: uint16 x y z, instance; uint16 scan; uint8 intensity, belief, cause, flags; 2 unused.
async function decodePoints(base64, packing) {
  const bytes = await inflated(base64);
  const total = packing.chunks.reduce((sum, chunk) => sum + chunk.count, 0);
  if (bytes.length !== 14 * total) throw new Error('the points of this page are damaged');
  const vertices = new ArrayBuffer(VERTEX_BYTES * total);
  const words = new Uint16Array(vertices);
  const octets = new Uint8Array(vertices);
  const wordOf = [0, 1, 2, 4, 3];  // columns x, y, z, scan, instance
  for (let column = 0; column < 5; ++column) {
    const low = 2 * column * total;
    let i = 0;
    for (const chunk of packing.chunks) {
      let value = 0;
      for (const end = i + chunk.count; i < end; ++i) {
        value = (value + bytes[low + i] + 256 * bytes[low + total + i]) & 0xffff;
        words[8 * i + wordOf[column]] = value;
      }
    }
  }
  for (let column = 0; column < 4; ++column) {
    const begin = (10 + column) * total;
    for (let i = 0; i < total; ++i) octets[VERTEX_BYTES * i + 10 + column] = bytes[begin + i];
  }
  let first = 0;
  const chunks = packing.chunks.map((chunk) => {
    const placed = {...chunk, first};
    first += chunk.count;
    return placed;
  });
  return {total, vertices, words, octets, chunks, unit: packing.unit};
}

// The values of point i.
function pointAt(points, i) {
  const chunk = points.chunks.find((c) => i < c.first + c.count);
  const word = (k) => points.words[8 * i + k];
  const octet = (k) => points.octets[VERTEX_BYTES * i + k];
  return {
    layer: chunk.layer,
    local: [0, 1, 2].map((axis) => chunk.origin[axis] + points.unit * word(axis)),
    instance: word(3), scan: word(4), intensity: octet(10) / 255, belief: octet(11) / 255,
    cause: octet(12), label: octet(13) & 3, truth: octet(13) >> 2,
  };
}

// What most heights lie between; at least 1 m apart.
function heightRange(points) {
  const heights = [];
  const step = Math.max(1, Math.floor(points.total / 20000));
  for (let i = 0; i < points.total; i += step) heights.push(pointAt(points, i).local[2]);
  heights.sort((a, b) => a - b);
  const at = (share) => heights[Math.floor(share * (heights.length - 1))] ?? 0;
  return [at(0.02), Math.max(at(0.98), at(0.02) + 1)];
}
