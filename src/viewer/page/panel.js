// Texts: the card of a point, the filter by cause, the legend.

const count = (number) => number.toLocaleString('en-US');
const element = (id) => document.getElementById(id);

const CAUSE_COLOURS = [
  [0.40, 0.42, 0.46], [0.55, 0.47, 0.38], [0.45, 0.62, 0.80], [0.30, 0.75, 0.70],
  [0.50, 0.50, 0.62], [0.60, 0.56, 0.70], [0.33, 0.35, 0.40], [0.95, 0.35, 0.65],
  [0.95, 0.25, 0.20], [1.00, 0.55, 0.10], [0.80, 0.65, 0.20], [0.55, 0.62, 0.70],
  [0.85, 0.30, 0.85], [0.60, 0.35, 0.95], [0.35, 0.55, 0.90], [0.30, 0.80, 0.45],
  [0.98, 0.85, 0.35], [0.70, 0.95, 0.20], [0.20, 0.65, 0.60]];

const LABELS = ['not judged', 'static', 'moving'];
const css = (colour) => `rgb(${colour.map((value) => Math.round(255 * value)).join(' ')})`;

// A new element.
function made(tag, properties, ...content) {
  const node = Object.assign(document.createElement(tag), properties);
  node.append(...content);
  return node;
}

const swatch = (colour) => made('i', {style: `background: ${css(colour)}`});

function summaryOf({scans, counts, has_truth}, {counts: shown}) {
  let text = `${count(scans.length)} scans, ${count(counts.points)} points. ` +
    `This page has ${count(shown[0])} static points and ${count(shown[1])} of ` +
    `${count(counts.moving)} removed points.`;
  if (has_truth) {
    text += ` By ground truth, ${count(counts.missed)} moving points were missed and ` +
      `${count(counts.lost)} static points were lost.`;
  }
  return text;
}

function errorOf(point) {
  if (point.truth === 0) return 'not known';
  const moves = point.truth === 2;
  const truth = LABELS[moves ? 2 : 1];
  if (moves === (point.label === 2)) return `${truth}: right`;
  return truth + (point.label === 2 ? ': lost static point' : ': missed moving point');
}

function factsOf(description, points, index) {
  const point = pointAt(points, index);
  const scan = description.scans[point.scan];
  const world = point.local.map((value, axis) => (value + description.origin[axis]).toFixed(2));
  const facts = [
    ['scan', `${scan.name} (${scan.time.toFixed(2)} s)`],
    ['instance', point.instance === 0 ? 'none' : String(point.instance)],
    ['label', LABELS[point.label]],
    ['belief', description.has_beliefs ? point.belief.toFixed(2)
      : 'not in the files (dynains run --write-beliefs)'],
    ['cause', description.causes[point.cause].name],
  ];
  if (description.has_truth) facts.push(['ground truth', errorOf(point)]);
  facts.push(['position', world.join(', ') + ' m']);
  return facts;
}

function showCard(facts) {
  const rows = facts.flatMap(([name, text]) => [made('dt', {}, name), made('dd', {}, text)]);
  element('facts').replaceChildren(made('dl', {}, ...rows));
  element('card').hidden = false;
}

function legendOf(mode, description) {
  const entries = {
    0: [['static', [0.6, 0.6, 0.6]], ['removed: a colour for each instance', [0.95, 0.45, 0.35]]],
    3: [['ground', [0.55, 0.47, 0.38]], ['static', [0.45, 0.62, 0.80]],
      ['moving', [0.95, 0.25, 0.20]]],
    4: [['belief 0', [0.16, 0.23, 0.55]], ['belief 1', [0.98, 0.86, 0.30]]],
    6: [['ground', [0.6, 0.6, 0.6]], ['static object', [0.45, 0.62, 0.80]],
      ['lost static object', [0.95, 0.30, 0.90]], ['lost ground', [1, 0.55, 0]],
      ['removed moving', [0.12, 0.63, 0.24]], ['missed moving', [0.86, 0.08, 0.12]],
      ['no ground truth', [0.25, 0.27, 0.32]]],
  }[mode] ?? [];
  const parts = entries.flatMap(([name, colour]) => [swatch(colour), name + '  ']);
  if (mode === 4 && !description.has_beliefs) parts.push('The run wrote no beliefs.');
  return parts;
}
