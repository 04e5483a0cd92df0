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
  return html("div", { class: "score" }, html("strong", {}, percent(grade.share)), html("span", {}, TEXT.points(grade.score, grade.most)),
    grade.grade ? html("span", {}, TEXT.grade(grade.grade)) : null, verdict);
}

function drawReasons(session) {
  const grade = session.grade, training = session.training;
  if (!grade) return null;
  const warnings = [];
  if (!grade.complete) warnings.push(TEXT.incomplete);
  if (session.damaged_bytes) warnings.push(TEXT.damaged(session.damaged_bytes));
  const clipped = grade.earned - grade.charged < 0 ? ` (${TEXT.atLeastZero})` : "";
  const c = TEXT.columns;
  const tasks = grade.tasks.map((task, i) => {
    const of = training.tasks[i] ? training.tasks[i].points : 0;
    const name = html("span", {}, task.name, task.required ? html("small", {}, ` ${TEXT.required}`) : null);
    return cells(html("tr", { class: task.outcome }), jump(task.ended, task.name), name, TEXT.outcomes[task.outcome],
      task.cause ? TEXT.event(task.cause) : task.outcome === "done" ? TEXT.noCause : TEXT.none, `${figure(task.points, 2)} / ${figure(of, 2)}`);
  });
  const charges = grade.charges.map((charge, i) => {
    const rule = training.penalties.find((each) => each.name === charge.rule);
    const words = html("span", {}, charge.rule, rule ? html("small", {}, ` ${TEXT.rulePoints(rule)}`) : null);
    return cells(markAt(html("tr", { class: "charge" }), charge.t), `${i + 1}`, jump(charge.t, charge.rule), words,
      charge.cause ? TEXT.event(charge.cause) : TEXT.noCause, figure(-charge.points, 2));
  });
  return titled(3, TEXT.why, training.text ? html("p", {}, training.text) : null, ...warnings.map((words) => html("p", { class: "warning" }, words)),
    table(TEXT.tasks, [c.second, c.task, c.outcome, c.cause, c.points], tasks, "tasks"),
    charges.length ? table(TEXT.charges, [c.number, c.second, c.rule, c.cause, c.points], charges, "charges") : html("p", {}, TEXT.noCharges),
    html("p", { class: "sum" }, TEXT.sum(grade.earned, grade.charged, grade.score) + clipped));
}

function drawEvents(session) {
  const list = html("ol", { class: "events" });
  for (const event of session.events) list.append(markAt(html("li", { class: event.unsensed ? "unsensed" : null }, jump(event.t, TEXT.event(event)), ` ${TEXT.event(event)}`), event.t));
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
function drawChargePictures(session) {
  const figures = [];
  (session.grade ? session.grade.charges : []).forEach((charge, i) => {
    const picture = session.pictures.length ? pictureAt(session, charge.t) : null;
    if (!picture || Math.abs(picture.t - charge.t) > 1) return;
    figures.push(html("figure", {}, html("img", { src: source(picture), alt: TEXT.pictureAlt(picture.t), width: picture.width, height: picture.height }),
      html("figcaption", {}, `${i + 1}. ${charge.rule}, ${clock(charge.t)}`)));
  });
  return figures.length ? titled(3, TEXT.chargePictures, html("div", { class: "gallery" }, ...figures)) : null;
}

const scoreOf = (session) => ({ ...session.grade, log: session.log, scenario: session.scenario, begin_us: session.begin_us, charges: session.grade.charges.length });

/// A dot for each session on a line from 0 to 100 %.
function drawShares(rows, mark) {
  const width = 640, x = (share) => 20 + (width - 40) * share;
  const drawing = svg("svg", { class: "shares", viewBox: `0 0 ${width} 76`, role: "img", "aria-label": TEXT.shareLabel });
  for (const share of [0, 0.25, 0.5, 0.75, 1]) drawing.append(svg("path", { class: "grid", d: `M${x(share)} 8v48` }), svg("text", { x: x(share), y: 71, "text-anchor": "middle" }, percent(share)));
  if (mark > 0) drawing.append(svg("path", { class: "charged", d: `M${x(mark)} 4v52` }, svg("title", {}, TEXT.passMark(mark))));
  const lanes = { group: 46, earlier: 32, other: 18, now: 18 };
  for (const row of [...rows].reverse()) drawing.append(svg("circle", { class: `share ${row.group}`, cx: x(row.share), cy: lanes[row.group], r: row.group === "now" ? 8 : 5 }, svg("title", {}, row.log)));
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
    day(r.begin_us), `${figure(r.score, 2)} / ${figure(r.most, 2)}`, percent(r.share), r.grade || TEXT.none, r.passed ? TEXT.yes : TEXT.no, `${r.charges}`, figure(r.charged, 2), clock(r.seconds)));
  const alike = rows.filter((r) => r.scenario === wanted || r.group === "other");
  const group = alike.filter((r) => r.group === "group").map((r) => r.share).sort((a, b) => a - b);
  const median = group.length ? (group[(group.length - 1) >> 1] + group[group.length >> 1]) / 2 : 0;
  const training = review.sessions[0].training;
  return titled(2, TEXT.comparison, drawShares(alike, training ? training.pass_mark : 0), group.length ? html("p", {}, TEXT.groupMedian(median, group.length)) : null,
    table(TEXT.comparison, TEXT.comparisonColumns, lines, "comparison"));
}

/// Two sessions, figure by figure.
function drawFigures(sessions) {
  if (sessions.length < 2) return null;
  const most = (s, name) => (s.series[name] ? figure(Math.max(...s.series[name].v), 2) : TEXT.none);
  const least = (s, name) => (s.series[name] ? figure(Math.min(...s.series[name].v), 2) : TEXT.none);
  const graded = (s, pick) => (s.grade ? pick(s.grade) : TEXT.none);
  const values = {
    score: (s) => graded(s, (g) => `${figure(g.score, 2)} / ${figure(g.most, 2)}`), charged: (s) => graded(s, (g) => figure(g.charged, 2)),
    charges: (s) => graded(s, (g) => `${g.charges.length}`), length: (s) => figure(s.path.length, 1), speed: (s) => most(s, "speed"),
    nearest: (s) => least(s, "nearest"), seconds: (s) => clock(s.duration),
  };
  const rows = sessions.map((s, i) => cells(html("tr", {}, html("th", { scope: "row" }, TEXT.run("AB"[i]))), ...Object.values(values).map((value) => value(s))));
  return table(TEXT.figures, [TEXT.none, ...Object.keys(values).map((name) => TEXT.figureRows[name])], rows, "figures");
}
