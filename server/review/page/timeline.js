// The timeline: lanes of tasks, penalties and events, the control of the current moment, and the plots.
const LANE = { width: 1280, left: 70, right: 10, height: 72 };
const timeScale = (session, frame) => (t) => frame.left + ((frame.width - frame.left - frame.right) * t) / Math.max(session.duration, 1e-3);

/// A click anywhere on it selects that moment.
function pressable(drawing, session, frame) {
  drawing.addEventListener("click", (event) => {
    const box = drawing.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * frame.width;
    const fraction = (x - frame.left) / (frame.width - frame.left - frame.right);
    if (fraction >= -0.01 && fraction <= 1.01) moment.set(Math.min(Math.max(fraction, 0), 1) * session.duration);
  });
}

function drawTimeline(session, letter) {
  const at = timeScale(session, LANE);
  const drawing = svg("svg", { class: "timeline", viewBox: `0 0 ${LANE.width} ${LANE.height}`, role: "img", "aria-label": TEXT.timelineLabel(session) });
  const word = (x, y, words, attributes) => svg("text", { x, y, ...attributes }, words);
  [TEXT.laneTasks, TEXT.laneDeductions, TEXT.laneEvents].forEach((words, i) => drawing.append(word(0, 13 + 18 * i, words, { class: "lane" })));
  for (const task of session.grade ? session.grade.tasks : []) {
    if (task.began === null) continue;
    const end = task.ended === null ? session.duration : task.ended, wide = at(end) - at(task.began);
    drawing.append(svg("rect", { class: `task ${task.outcome}`, x: at(task.began), y: 2, width: Math.max(wide - 1, 1), height: 14 }, svg("title", {}, task.name)));
    if (wide > 7 * task.name.length) drawing.append(word(at(task.began) + 4, 13, task.name, { class: "task" }));
  }
  for (const event of session.events) {
    if (event.kind !== "mark") drawing.append(svg("path", { class: "event", d: `M${at(event.t)} 40v12` }));
    else drawing.append(svg("path", { class: "mark", d: `M${at(event.t)} 39l6 7l-6 7l-6 -7z` }, svg("title", {}, TEXT.event(event))));
  }
  (session.grade ? session.grade.deductions : []).forEach((deduction, i) => {
    drawing.append(svg("circle", { class: "deduction", cx: at(deduction.t), cy: 27, r: 7 }, svg("title", {}, `${i + 1}: ${deduction.rule}`)),
      word(at(deduction.t), 31, `${i + 1}`, { class: "deduction", "text-anchor": "middle" }));
  });
  for (const t of timeTicks(session.duration, 12)) {
    const near = at(t) > LANE.width - 30 ? "end" : "middle";
    drawing.append(svg("path", { class: "grid", d: `M${at(t)} 54v4` }), word(at(t), 68, shortClock(t), { class: "tick", "text-anchor": near }));
  }
  const cursor = svg("path", { class: "cursor" });
  drawing.append(cursor);
  moment.watch((t) => cursor.setAttribute("d", `M${at(Math.min(t, session.duration))} 0v56`));
  pressable(drawing, session, LANE);
  return html("div", { class: "strip" }, letter ? html("span", { class: "letter" }, TEXT.run(letter)) : null, drawing);
}

/// Slider and buttons, so that the page can be used by keyboard.
function drawControl(sessions) {
  const longest = Math.max(...sessions.map((s) => s.duration));
  const deducted = [...new Set(sessions.flatMap((s) => (s.grade ? s.grade.deductions : []).map((c) => c.t)))].sort((a, b) => a - b);
  const slider = html("input", { type: "range", id: "moment", min: 0, max: longest, step: "any", value: 0, oninput: () => moment.set(Number(slider.value)) });
  // "any" would step by a hundredth of the total, too coarse to see a contact.
  slider.step = longest > 600 ? "1" : "0.1";
  const words = html("output", { for: "moment", id: "second" });
  moment.watch((t) => {
    slider.value = t;
    slider.setAttribute("aria-valuetext", clock(t));
    words.textContent = clock(t);
  });
  const step = (later) => {
    const t = later ? deducted.find((c) => c > moment.t + 1e-6) : deducted.findLast((c) => c < moment.t - 1e-6);
    if (t !== undefined) moment.set(t);
  };
  const button = (text, later) => html("button", { type: "button", disabled: deducted.length === 0, onclick: () => step(later) }, text);
  return html("div", { class: "control" }, html("label", { for: "moment" }, TEXT.moment), slider, words, button(TEXT.previous, false), button(TEXT.next, true));
}

const PLOT = { width: 640, height: 150, left: 44, right: 8, top: 8, bottom: 20 };
const PLOTS = [
  ["score", ["score"]], ["speed", ["speed"]], ["nearest", ["nearest", "nearest_injected"]], ["forward", ["commanded_forward", "applied_forward"]],
  ["turn", ["commanded_turn", "applied_turn"]], ["attitude", ["pitch", "roll"]], ["delay", ["delay_scan", "delay_camera", "delay_teleop"]],
];

/// The score over time: steps at awards and deductions.
function scoreSeries(session) {
  const grade = session.grade;
  if (!grade) return null;
  const changes = [...grade.tasks.filter((task) => task.ended !== null && task.points).map((task) => [task.ended, task.points]),
    ...grade.deductions.map((deduction) => [deduction.t, -deduction.points])].sort((a, b) => a[0] - b[0]);
  const series = { t: [0], v: [0], width: Infinity };
  let sum = 0;
  const add = (t) => { series.t.push(t); series.v.push(Math.max(sum, 0)); };
  for (const [t, points] of changes) { add(t); sum += points; add(t); }
  add(session.duration);
  return series;
}

/// The line is interrupted where samples are missing for long.
function plotLine(series, x, y) {
  const gap = Math.max(1, 4 * series.width);
  let d = "";
  series.t.forEach((t, i) => { d += `${i === 0 || t - series.t[i - 1] > gap ? "M" : "L"}${x(t).toFixed(1)} ${y(series.v[i]).toFixed(1)}`; });
  return d;
}

function drawPlot(session, [name, wanted]) {
  const there = wanted.filter((each) => session.series[each] && session.series[each].t.length);
  const unit = TEXT.units[name], title = TEXT.plotTitles[name];
  if (!there.length) return html("figure", { class: "plot" }, html("figcaption", {}, html("b", {}, title)), html("p", { class: "absent" }, TEXT.noSeries));
  let low = 0, high = 0;
  for (const each of there) for (const v of session.series[each].v) { low = Math.min(low, v); high = Math.max(high, v); }
  // Large distances matter little.
  if (name === "nearest") high = Math.min(high, 5);
  const range = [low, high];
  if (high - low < 0.1) high = low + 0.1;
  const x = timeScale(session, PLOT), inner = PLOT.height - PLOT.top - PLOT.bottom;
  const y = (v) => PLOT.top + inner * (1 - (Math.min(v, high) - low) / (high - low));
  const drawing = svg("svg", { viewBox: `0 0 ${PLOT.width} ${PLOT.height}`, role: "img", "aria-label": TEXT.plotLabel(title, unit, range) });
  const right = PLOT.width - PLOT.right;
  for (const v of ticks(low, high, 4))
    drawing.append(svg("path", { class: Math.abs(v) < 1e-9 ? "grid zero" : "grid", d: `M${PLOT.left} ${y(v)}H${right}` }), svg("text", { x: PLOT.left - 5, y: y(v) + 4, "text-anchor": "end" }, figure(v, 2)));
  for (const t of timeTicks(session.duration, 6))
    drawing.append(svg("text", { x: x(t), y: PLOT.height - 5, "text-anchor": x(t) > right - 20 ? "end" : "middle" }, shortClock(t)));
  for (const deduction of session.grade ? session.grade.deductions : []) drawing.append(svg("path", { class: "deducted", d: `M${x(deduction.t)} ${PLOT.top}v${inner}` }));
  const values = there.map((each) => html("output", {}));
  there.forEach((each) => drawing.append(svg("path", { class: `line l${wanted.indexOf(each)}`, d: plotLine(session.series[each], x, y) })));
  const cursor = svg("path", { class: "cursor" });
  drawing.append(cursor);
  moment.watch((t) => {
    cursor.setAttribute("d", `M${x(Math.min(t, session.duration))} ${PLOT.top}v${inner}`);
    there.forEach((each, i) => {
      const series = session.series[each], k = lastAtMost(series.t, t);
      const known = k >= 0 && t - series.t[k] <= Math.max(1, 4 * series.width);
      values[i].textContent = known ? `${figure(series.v[k], 2)} ${unit}` : TEXT.none;
    });
  });
  pressable(drawing, session, PLOT);
  const key = there.map((each, i) => html("span", { class: "legend" }, html("span", { class: `swatch l${wanted.indexOf(each)}` }), `${TEXT.series[each]} `, values[i]));
  return html("figure", { class: "plot" }, html("figcaption", {}, html("b", {}, `${title}, ${unit}`), ...key), drawing);
}

function drawPlots(session) {
  const score = scoreSeries(session);
  if (score) session.series.score = score;
  const plots = PLOTS.filter(([name]) => name !== "score" || score);
  return titled(3, TEXT.plots, html("div", { class: "plots" }, ...plots.map((plot) => drawPlot(session, plot))));
}
