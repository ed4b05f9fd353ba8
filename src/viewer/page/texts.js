// Texts and elements of a page.

const count = (number) => number.toLocaleString('en-US');
const element = (id) => document.getElementById(id);

// What most values lie between; at least 1 apart. Sorts the values.
function rangeOf(values) {
  values.sort((a, b) => a - b);
  const at = (share) => values[Math.floor(share * (values.length - 1))] ?? 0;
  return [at(0.02), Math.max(at(0.98), at(0.02) + 1)];
}
