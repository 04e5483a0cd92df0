// DOM elements, scales, and the current moment of the page.
function fill(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes || {})) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value === true) node.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) node.setAttribute(name, value);
  }
  // Text from the log becomes text nodes, never markup.
  node.append(...children.filter((child) => child !== null && child !== undefined));
  return node;
}
const html = (name, attributes, ...children) => fill(document.createElement(name), attributes, children);
const svg = (name, attributes, ...children) => fill(document.createElementNS("http://www.w3.org/2000/svg", name), attributes, children);
const titled = (level, words, ...children) => html("section", {}, html(`h${level}`, {}, words), ...children);

/// The time in s that map, plots, timeline and picture show; one for the page.
const moment = {
  t: 0,
  watchers: [],
  watch(watcher) { this.watchers.push(watcher); },
  set(t) {
    this.t = t;
    for (const watcher of this.watchers) watcher(t);
  },
};

/// Index of the last element of `sorted` that is not above `value`; -1: all are above.
function lastAtMost(sorted, value) {
  let low = 0, high = sorted.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (sorted[middle] <= value) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/// Round tick values between two numbers.
function ticks(low, high, about) {
  const raw = (high - low) / about, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((n) => n * power).find((n) => n >= raw * 0.999);
  const all = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-9; ++i) all.push(i * step);
  return all;
}

/// Tick values for times: seconds, then minutes.
function timeTicks(duration, about) {
  const steps = [0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600];
  const step = steps.find((s) => duration / s <= about) || 7200;
  const all = [];
  for (let t = 0; t <= duration; t += step) all.push(t);
  return all;
}
const shortClock = (t) => clock(t).replace(/\.0$/, "");

/// Position on a trail at t: interpolated between two points, but never across a jump. None more than a
/// second before its first point.
function placeAt(trail, t) {
  const i = Math.max(lastAtMost(trail.t, t), 0);
  if (trail.t.length === 0 || trail.t[i] > t + 1) return null;
  const j = Math.min(i + 1, trail.t.length - 1);
  const at = (k) => ({ x: trail.x[k], y: trail.y[k], yaw: trail.yaw[k] });
  if (i === j || trail.t[i] >= t || trail.jumps.includes(j)) return at(i);
  const s = (t - trail.t[i]) / (trail.t[j] - trail.t[i]), a = at(i), b = at(j);
  const turn = Math.atan2(Math.sin(b.yaw - a.yaw), Math.cos(b.yaw - a.yaw));
  return { x: a.x + s * (b.x - a.x), y: a.y + s * (b.y - a.y), yaw: a.yaw + s * turn };
}
