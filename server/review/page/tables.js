// The explanation of the score, the events, the pictures, and the results of others.
function table(caption, heads, rows, className) {
  const head = html("tr", {}, ...heads.map((words) => html("th", { scope: "col" }, words)));
  return html("table", { class: className }, html("caption", {}, caption), html("thead", {}, head), html("tbody", {}, ...rows));
}
const cells = (row, ...contents) => { row.append(...contents.map((content) => html("td", {}, content))); return row; };

/// A time as a button that jumps to it.
function jump(t, what) {
  if (t === null) return html("span", {}, TEXT.none);
  return html("button", { type: "button", class: "jump", "aria-label": TEXT.goTo(what, t), onclick: () => moment.set(t) }, clock(t));
}

/// Highlights the row at the current moment.
function markAt(row, t) {
  moment.watch((now) => { if (Math.abs(now - t) < 1e-6) row.setAttribute("aria-current", "true"); else row.removeAttribute("aria-current"); });
  return row;
}

function drawScore(session) {
  const grade = session.grade;
  if (!grade) return html("p", { class: "score" }, TEXT.ungraded);
  const verdict = html("span", { class: grade.passed ? "verdict passed" : "verdict failed" }, grade.passed ? TEXT.passed : TEXT.notPassed);
  return html("div", { class: "score" }, html("strong", {}, percent(grade.fraction)), html("span", {}, TEXT.points(grade.score, grade.max)),
    grade.grade ? html("span", {}, TEXT.grade(grade.grade)) : null, verdict);
}

function drawReasons(session) {
  const grade = session.grade, training = session.training;
  if (!grade) return null;
  const warnings = [];
  if (!grade.complete) warnings.push(TEXT.incomplete);
  if (session.damaged_bytes) warnings.push(TEXT.damaged(session.damaged_bytes));
  const clipped = grade.awarded - grade.deducted < 0 ? ` (${TEXT.atLeastZero})` : "";
  const c = TEXT.columns;
  const tasks = grade.tasks.map((task, i) => {
    const of = training.tasks[i] ? training.tasks[i].points : 0;
    const name = html("span", {}, task.name, task.required ? html("small", {}, ` ${TEXT.required}`) : null);
    return cells(html("tr", { class: task.outcome }), jump(task.ended, task.name), name, TEXT.outcomes[task.outcome],
      task.cause ? TEXT.event(task.cause) : task.outcome === "done" ? TEXT.noCause : TEXT.none, `${figure(task.points, 2)} / ${figure(of, 2)}`);
  });
  const deductions = grade.deductions.map((deduction, i) => {
    const rule = training.penalties.find((each) => each.name === deduction.rule);
    const words = html("span", {}, deduction.rule, rule ? html("small", {}, ` ${TEXT.rulePoints(rule)}`) : null);
    return cells(markAt(html("tr", { class: "deduction" }), deduction.t), `${i + 1}`, jump(deduction.t, deduction.rule), words,
      deduction.cause ? TEXT.event(deduction.cause) : TEXT.noCause, figure(-deduction.points, 2));
  });
  return titled(3, TEXT.why, training.text ? html("p", {}, training.text) : null, ...warnings.map((words) => html("p", { class: "warning" }, words)),
    table(TEXT.tasks, [c.second, c.task, c.outcome, c.cause, c.points], tasks, "tasks"),
    deductions.length ? table(TEXT.deductions, [c.number, c.second, c.rule, c.cause, c.points], deductions, "deductions") : html("p", {}, TEXT.noDeductions),
    html("p", { class: "sum" }, TEXT.sum(grade.awarded, grade.deducted, grade.score) + clipped));
}

function drawEvents(session) {
  const list = html("ol", { class: "events" });
  for (const event of session.events) list.append(markAt(html("li", { class: event.undetectable ? "undetectable" : event.kind === "mark" ? "mark" : null }, jump(event.t, TEXT.event(event)), ` ${TEXT.event(event)}`), event.t));
  const left = Object.keys(session.events_left_out).length ? html("p", {}, TEXT.eventsLeftOut(session.events_left_out)) : null;
  return titled(3, TEXT.events, list, left);
}

const source = (picture) => `data:image/jpeg;base64,${picture.jpeg}`;

/// The last picture up to this time, or the first one.
function pictureAt(session, t) {
  const i = lastAtMost(session.pictures.map((p) => p.t), t);
  return session.pictures[Math.max(i, 0)];
}

/// The picture nearest in time, on the screen only.
function drawPicture(session) {
  if (!session.pictures.length) return html("section", { class: "picture" }, html("h3", {}, TEXT.picture), html("p", {}, TEXT.noPictures));
  const image = html("img", { alt: "" }), words = html("figcaption", {});
  moment.watch((t) => {
    const picture = pictureAt(session, t), near = Math.abs(picture.t - t) <= 10;
    image.hidden = !near;
    words.textContent = near ? TEXT.pictureAt(picture.t, t) : TEXT.noPictureHere;
    if (!near || image.dataset.t === String(picture.t)) return;
    image.dataset.t = picture.t;
    image.src = source(picture);
    image.alt = TEXT.pictureAlt(picture.t);
    image.width = picture.width;
    image.height = picture.height;
  });
  return html("section", { class: "picture" }, html("h3", {}, TEXT.picture), html("figure", {}, image, words));
}

/// One picture for each penalty that has one within a second; also in print.
function drawDeductionPictures(session) {
  const figures = [];
  (session.grade ? session.grade.deductions : []).forEach((deduction, i) => {
    const picture = session.pictures.length ? pictureAt(session, deduction.t) : null;
    if (!picture || Math.abs(picture.t - deduction.t) > 1) return;
    figures.push(html("figure", {}, html("img", { src: source(picture), alt: TEXT.pictureAlt(picture.t), width: picture.width, height: picture.height }),
      html("figcaption", {}, `${i + 1}. ${deduction.rule}, ${clock(deduction.t)}`)));
  });
  return figures.length ? titled(3, TEXT.deductionPictures, html("div", { class: "gallery" }, ...figures)) : null;
}

const scoreOf = (session) => ({ ...session.grade, log: session.log, scenario: session.scenario, begin_us: session.begin_us, deductions: session.grade.deductions.length });

/// A dot for each session on a line from 0 to 100 %.
function drawFractions(rows, mark) {
  const width = 640, x = (fraction) => 20 + (width - 40) * fraction;
  const drawing = svg("svg", { class: "fractions", viewBox: `0 0 ${width} 76`, role: "img", "aria-label": TEXT.fractionLabel });
  for (const fraction of [0, 0.25, 0.5, 0.75, 1]) drawing.append(svg("path", { class: "grid", d: `M${x(fraction)} 8v48` }), svg("text", { x: x(fraction), y: 71, "text-anchor": "middle" }, percent(fraction)));
  if (mark > 0) drawing.append(svg("path", { class: "deducted", d: `M${x(mark)} 4v52` }, svg("title", {}, TEXT.passMark(mark))));
  const lanes = { group: 46, earlier: 32, other: 18, now: 18 };
  for (const row of [...rows].reverse()) drawing.append(svg("circle", { class: `fraction ${row.group}`, cx: x(row.fraction), cy: lanes[row.group], r: row.group === "now" ? 8 : 5 }, svg("title", {}, row.log)));
  return drawing;
}

function drawComparison(review) {
  const graded = review.sessions.filter((s) => s.grade);
  const rows = [...graded.map((s, i) => ({ ...scoreOf(s), group: i === 0 ? "now" : "other" })),
    ...review.earlier.map((s) => ({ ...s, group: "earlier" })), ...review.group.map((s) => ({ ...s, group: "group" }))];
  if (rows.length < 2) return null;
  const wanted = review.sessions[0].scenario;
  const lines = rows.map((r) => cells(html("tr", { class: r.group }),
    html("span", {}, html("span", { class: `key ${r.group}` }, TEXT.groups[r.group]), ` ${r.log}`, r.scenario === wanted ? null : html("small", {}, ` ${TEXT.otherScenario(r.scenario)}`)),
    day(r.begin_us), `${figure(r.score, 2)} / ${figure(r.max, 2)}`, percent(r.fraction), r.grade || TEXT.none, r.passed ? TEXT.yes : TEXT.no, `${r.deductions}`, figure(r.deducted, 2), clock(r.seconds)));
  const alike = rows.filter((r) => r.scenario === wanted || r.group === "other");
  const group = alike.filter((r) => r.group === "group").map((r) => r.fraction).sort((a, b) => a - b);
  const median = group.length ? (group[(group.length - 1) >> 1] + group[group.length >> 1]) / 2 : 0;
  const training = review.sessions[0].training;
  return titled(2, TEXT.comparison, drawFractions(alike, training ? training.pass_mark : 0), group.length ? html("p", {}, TEXT.groupMedian(median, group.length)) : null,
    table(TEXT.comparison, TEXT.comparisonColumns, lines, "comparison"));
}

/// Two sessions, figure by figure.
function drawFigures(sessions) {
  if (sessions.length < 2) return null;
  const max = (s, name) => (s.series[name] ? figure(Math.max(...s.series[name].v), 2) : TEXT.none);
  const min = (s, name) => (s.series[name] ? figure(Math.min(...s.series[name].v), 2) : TEXT.none);
  const graded = (s, pick) => (s.grade ? pick(s.grade) : TEXT.none);
  const values = {
    score: (s) => graded(s, (g) => `${figure(g.score, 2)} / ${figure(g.max, 2)}`), deducted: (s) => graded(s, (g) => figure(g.deducted, 2)),
    deductions: (s) => graded(s, (g) => `${g.deductions.length}`), length: (s) => figure(s.path.length, 1), speed: (s) => max(s, "speed"),
    nearest: (s) => min(s, "nearest"), seconds: (s) => clock(s.duration),
  };
  const rows = sessions.map((s, i) => cells(html("tr", {}, html("th", { scope: "row" }, TEXT.run("AB"[i]))), ...Object.values(values).map((value) => value(s))));
  return table(TEXT.figures, [TEXT.none, ...Object.keys(values).map((name) => TEXT.figureRows[name])], rows, "figures");
}
