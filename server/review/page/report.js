// Assembles the page.
function drawHead(review) {
  const first = review.sessions[0], two = review.sessions.length > 1;
  document.title = `${TEXT.title}: ${first.scenario}`;
  const line = (s) => html("p", { class: "about" }, [TEXT.level(s.level), TEXT.robot(s.robot), `${day(s.begin_us)} UTC`, clock(s.duration), TEXT.log(s.log)].join(" · "));
  return html("header", {}, html("div", {}, html("h1", {}, two ? TEXT.against : `${TEXT.title}: ${first.scenario}`), two ? null : line(first)), two ? drawFigures(review.sessions) : drawScore(first));
}

function drawSession(session, letter) {
  const article = html("article", { class: "session" });
  if (letter) article.append(html("h2", {}, `${TEXT.run(letter)}: ${session.scenario}, ${session.log}`), drawScore(session));
  else article.append(html("h2", { class: "unseen" }, session.scenario));
  const parts = { map: drawMap(session), picture: drawPicture(session), reasons: drawReasons(session), events: drawEvents(session), plots: drawPlots(session), pictures: drawDeductionPictures(session) };
  for (const [name, part] of Object.entries(parts)) if (part) part.classList.add(`part-${name}`);
  const column = (...names) => html("div", { class: "column" }, ...names.map((name) => parts[name]));
  article.append(html("div", { class: "columns" }, column("map", "picture"), column("reasons", "events")), parts.plots);
  if (parts.pictures) article.append(parts.pictures);
  return article;
}

function drawReview(review) {
  const two = review.sessions.length > 1, letters = two ? ["A", "B"] : [""];
  const page = document.getElementById("review");
  page.className = two ? "two" : "one";
  const bar = html("nav", { class: "bar", "aria-label": TEXT.timeline }, ...review.sessions.map((s, i) => drawTimeline(s, letters[i])), drawControl(review.sessions));
  page.append(drawHead(review), bar, html("div", { class: "sessions" }, ...review.sessions.map((s, i) => drawSession(s, letters[i]))));
  const comparison = drawComparison(review);
  if (comparison) page.append(comparison);
  page.append(html("footer", {}, html("p", {}, TEXT.made(review.program))));
  const first = review.sessions[0].grade;
  moment.set(first && first.deductions.length ? first.deductions[0].t : 0);
}

drawReview(JSON.parse(document.getElementById("data").textContent));
