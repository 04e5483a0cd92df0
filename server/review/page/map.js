// The building, the driven path coloured by speed, the paths of others, and all positions at the current
// moment.
const SPEED_STEPS = 5;

/// Left, bottom, right, top of all paths.
function extent(session) {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  const add = (x, y) => {
    box[0] = Math.min(box[0], x); box[1] = Math.min(box[1], y);
    box[2] = Math.max(box[2], x); box[3] = Math.max(box[3], y);
  };
  const own = session.path;
  own.t.forEach((_, i) => add(own.x[i], own.y[i]));
  if (!own.t.length) for (const part of session.plan.parts) for (const [x, y] of part.corners) add(x, y);
  if (box[0] > box[2]) add(0, 0);
  // Includes only nearby paths of others: a distant one must not shrink the driven path to a dot.
  const reach = Math.max(4, 0.5 * Math.max(box[2] - box[0], box[3] - box[1]));
  const near = [box[0] - reach, box[1] - reach, box[2] + reach, box[3] + reach];
  for (const agent of session.agents)
    agent.t.forEach((_, i) => {
      if (agent.x[i] > near[0] && agent.x[i] < near[2] && agent.y[i] > near[1] && agent.y[i] < near[3]) add(agent.x[i], agent.y[i]);
    });
  const margin = 1.5;
  const pathBox = [box[0] - margin, box[1] - margin, box[2] + margin, box[3] + margin];
  // Shows the whole building if it is not much larger.
  for (const part of session.plan.parts) for (const [x, y] of part.corners) add(x, y);
  const whole = [box[0] - 0.3, box[1] - 0.3, box[2] + 0.3, box[3] + 0.3];
  const side = (b) => Math.max(b[2] - b[0], b[3] - b[1]);
  return side(whole) <= 1.6 * side(pathBox) ? whole : pathBox;
}

/// One line for each run of points in one speed class; y of SVG points down.
function speedLines(path, top) {
  const lines = Array.from({ length: SPEED_STEPS }, () => "");
  let before = -1;
  for (let i = 1; i < path.t.length; ++i) {
    if (path.jumps.includes(i)) { before = -1; continue; }
    const step = Math.min(SPEED_STEPS - 1, Math.floor((path.speed[i] / top) * SPEED_STEPS));
    if (step !== before) lines[step] += `M${path.x[i - 1]} ${-path.y[i - 1]}`;
    lines[step] += `L${path.x[i]} ${-path.y[i]}`;
    before = step;
  }
  return lines;
}

function trailLine(trail) {
  return trail.t.map((_, i) => `${i === 0 || trail.jumps.includes(i) ? "M" : "L"}${trail.x[i]} ${-trail.y[i]}`).join("");
}

const polygon = (corners, attributes) => svg("polygon", { points: corners.map(([x, y]) => `${x},${-y}`).join(" "), ...attributes });

function drawPlan(plan) {
  const group = svg("g", { class: "plan" });
  for (const part of plan.parts) group.append(polygon(part.corners, { class: part.label }));
  if (plan.rows.length)
    group.append(svg("path", { class: "things", "stroke-width": plan.cell, d: plan.rows.map(([y, left, right]) => `M${left} ${-y}H${right}`).join("") }));
  for (const zone of plan.zones) group.append(polygon(zone.corners, { class: "zone" }));
  return group;
}

/// Deductions at one place share one mark.
function deductionMarks(session, near) {
  const marks = [];
  (session.grade ? session.grade.deductions : []).forEach((deduction, i) => {
    const place = placeAt(session.path, deduction.t);
    if (!place) return;
    const mark = marks.find((m) => Math.hypot(m.x - place.x, m.y - place.y) < near);
    if (mark) mark.numbers.push(i + 1);
    else marks.push({ ...place, t: deduction.t, numbers: [i + 1] });
  });
  const words = ({ numbers: n }) => (n.length === 1 ? `${n[0]}` : n[n.length - 1] - n[0] === n.length - 1 ? `${n[0]}–${n[n.length - 1]}` : `${n[0]}, …`);
  return marks.map((mark) => ({ ...mark, words: words(mark) }));
}

function speedKey(top) {
  const key = html("ul", { class: "key" });
  key.append(html("li", {}, TEXT.speedKey));
  for (let i = 0; i < SPEED_STEPS; ++i)
    key.append(html("li", {}, html("span", { class: `swatch v${i}` }), `${figure((top * i) / SPEED_STEPS, 2)}–${figure((top * (i + 1)) / SPEED_STEPS, 2)}`));
  key.append(html("li", {}, html("span", { class: "swatch others" }), TEXT.othersKey));
  key.append(html("li", {}, html("span", { class: "dot" }), TEXT.deductionKey));
  return key;
}

function drawMap(session) {
  if (!session.path.t.length) return titled(3, TEXT.map, html("p", {}, TEXT.noWorld));
  const whole = extent(session), width = 640, height = 440;
  const top = Math.max(0.1, ...session.path.speed);
  const drawing = svg("svg", { class: "map", role: "img", "aria-label": TEXT.mapLabel(session) });
  const view = { x: (whole[0] + whole[2]) / 2, y: -(whole[1] + whole[3]) / 2, pixel: Math.max((whole[2] - whole[0]) / width, (whole[3] - whole[1]) / height) };
  const fitted = { ...view };
  const upper = svg("g", {});
  drawing.append(drawPlan(session.plan));
  for (const agent of session.agents) drawing.append(svg("path", { class: "others", d: trailLine(agent) }));
  speedLines(session.path, top).forEach((d, i) => drawing.append(svg("path", { class: `way v${i}`, d })));
  drawing.append(upper);

  /// Elements with a fixed size on the screen at any scale.
  const draw = () => {
    const px = view.pixel;
    drawing.setAttribute("viewBox", `${view.x - (width / 2) * px} ${view.y - (height / 2) * px} ${width * px} ${height * px}`);
    const label = (x, y, words, attributes) => svg("text", { x, y, "font-size": 12 * px, ...attributes }, words);
    const parts = [];
    for (const agent of session.agents) {
      const place = placeAt(agent, moment.t);
      if (!place) continue;
      parts.push(svg("circle", { class: "agent", cx: place.x, cy: -place.y, r: 5 * px }));
      if (session.agents.length <= 12) parts.push(label(place.x + 8 * px, -place.y + 4 * px, agent.name, { class: "name" }));
    }
    for (const mark of deductionMarks(session, 16 * px)) {
      const wide = 4 + 3.5 * mark.words.length;
      parts.push(svg("g", { class: "deduction", onclick: () => moment.set(mark.t) },
        svg("rect", { x: mark.x - wide * px, y: -mark.y - 8 * px, width: 2 * wide * px, height: 16 * px, rx: 8 * px }),
        label(mark.x, -mark.y + 4 * px, mark.words, { "text-anchor": "middle" })));
    }
    const robot = placeAt(session.path, moment.t);
    if (robot) {
      const turned = `translate(${robot.x} ${-robot.y}) rotate(${(-robot.yaw * 180) / Math.PI})`;
      const shape = session.footprint.length ? polygon(session.footprint, { class: "footprint" }) : null;
      parts.push(svg("g", { class: "robot", transform: turned }, ...(shape ? [shape] : []),
        svg("path", { d: `M${11 * px} 0L${-7 * px} ${-6 * px}V${6 * px}Z` })));
    }
    const bar = ticks(0, 120 * px, 2)[1];
    const left = view.x - (width / 2 - 14) * px, low = view.y + (height / 2 - 14) * px;
    parts.push(svg("path", { class: "scale", d: `M${left} ${low - 5 * px}v${5 * px}h${bar}v${-5 * px}` }), label(left + 4 * px, low - 4 * px, TEXT.metres(figure(bar, 2)), {}));
    upper.replaceChildren(...parts);
  };
  const zoom = (factor) => { const robot = placeAt(session.path, moment.t); view.pixel *= factor; if (factor < 1 && robot) { view.x = robot.x; view.y = -robot.y; } draw(); };
  moment.watch(draw);
  draw();
  const button = (words, press) => html("button", { type: "button", onclick: press }, words);
  return titled(3, TEXT.map, html("div", { class: "tools" }, button(TEXT.closer, () => zoom(1 / 1.5)), button(TEXT.farther, () => zoom(1.5)),
    button(TEXT.fit, () => { Object.assign(view, fitted); draw(); })), drawing, speedKey(top));
}
