// All strings of the report, and number formats.
const TEXT = {
  title: "After-action review",
  against: "Comparison of two runs",
  level: (n) => `level ${n}`,
  robot: (name) => `robot ${name}`,
  log: (name) => `log ${name}`,
  run: (letter) => `Run ${letter}`,
  ungraded: "Not graded: the scenario has no training section",
  points: (score, max) => `${figure(score, 2)} of ${figure(max, 2)} points`,
  passed: "passed",
  notPassed: "not passed",
  grade: (name) => `grade ${name}`,
  incomplete: "The log is incomplete. It was graded as far as it goes.",
  damaged: (bytes) => `${bytes} bytes of the log are damaged and missing from this report.`,
  sum: (awarded, deducted, score) => `${figure(awarded, 2)} awarded − ${figure(deducted, 2)} deducted = ${figure(score, 2)}`,
  atLeastZero: "the score is never below 0",
  why: "Score breakdown",
  tasks: "Tasks",
  deductions: "Penalties",
  noDeductions: "No penalty.",
  columns: { number: "No.", second: "Time", task: "Task", outcome: "Outcome", rule: "Rule", cause: "Event", points: "Points" },
  outcomes: { waiting: "not reached", open: "not finished", done: "done", failed: "failed", out_of_time: "out of time" },
  required: "required",
  noCause: "caused by positions, not by an event",
  rulePoints: (rule) => {
    const parts = [];
    if (rule.points) parts.push(`${figure(rule.points, 2)} each time`);
    if (rule.per_impulse) parts.push(`${figure(rule.per_impulse, 2)} per N s`);
    if (rule.max !== null) parts.push(`at most ${figure(rule.max, 2)} in total`);
    return parts.join(", ");
  },
  goTo: (what, t) => `${what}, at ${clock(t)}: show this time`,
  map: "Map",
  mapLabel: (s) => `Map: path of ${s.path.name || s.robot}, ${figure(s.path.length, 1)} m, coloured by speed, ` +
    `${s.agents.length} others, and ${(s.grade ? s.grade.deductions : []).length} penalties`,
  speedKey: "speed, m/s",
  othersKey: "paths of others",
  deductionKey: "penalty, by number",
  zoneKey: "zone",
  closer: "Zoom in",
  farther: "Zoom out",
  fit: "Fit",
  noWorld: "The log has no pose of the robot.",
  metres: (n) => `${n} m`,
  timeline: "Timeline",
  timelineLabel: (s) => `Tasks, penalties and ${s.events.length} events over ${clock(s.duration)}`,
  laneTasks: "tasks",
  laneDeductions: "penalties",
  laneEvents: "events",
  moment: "Time",
  previous: "Previous penalty",
  next: "Next penalty",
  picture: "Camera image (MR_CAMERA)",
  pictureAt: (t, now) => `Image at ${clock(t)}${Math.abs(t - now) >= 0.05 ? `, ${figure(Math.abs(now - t), 1)} s ${t < now ? "before" : "after"} this time` : ""}`,
  pictureAlt: (t) => `Camera image at ${clock(t)}`,
  noPictures: "The log has no camera image (MR_CAMERA).",
  noPictureHere: "No camera image within 10 s of this time.",
  deductionPictures: "Camera images at penalties",
  now: "At this time",
  plots: "Plots",
  plotLabel: (title, unit, range) => `${title}, ${unit}${range ? `: from ${figure(range[0], 2)} to ${figure(range[1], 2)}` : ""}`,
  noSeries: "Not in the log.",
  plotTitles: {
    score: "Score", speed: "Speed", nearest: "Distance to the nearest obstacle", attitude: "Pitch and roll",
    forward: "Forward speed: commanded and applied", turn: "Turn rate: commanded and applied", delay: "Delay above the fastest message",
  },
  series: {
    score: "score", speed: "speed", nearest: "all returns", nearest_injected: "virtual", pitch: "pitch, nose up", roll: "roll, left up",
    commanded_forward: "commanded (TELEOP)", applied_forward: "applied (MR_CMD)", commanded_turn: "commanded (TELEOP)", applied_turn: "applied (MR_CMD)",
    delay_scan: "SCAN", delay_camera: "CAMERA", delay_teleop: "TELEOP",
  },
  units: { score: "points", speed: "m/s", nearest: "m", attitude: "°", forward: "m/s", turn: "rad/s", delay: "ms" },
  events: "Events",
  eventsLeftOut: (left) => `Omitted, too many of a kind: ${Object.entries(left).map(([kind, n]) => `${n} × ${TEXT.kind(kind)}`).join(", ")}.`,
  /** As on the page of the base station. */
  kind: (kind) => {
    const words = kind.replaceAll("_", " ").replace("dead man", "dead-man");
    return words.charAt(0).toUpperCase() + words.slice(1);
  },
  event: (e) => {
    let words = e.subject ? `${e.subject}: ${TEXT.kind(e.kind)}` : TEXT.kind(e.kind);
    if (e.object) words += `, ${e.object}`;
    if (e.kind === "near_miss") words += e.text === "time" ? ` (${figure(e.value, 2)} s to a collision)` : ` (${figure(e.value, 2)} m)`;
    else if (e.text) words += ` (${e.text})`;
    if (e.kind === "score_changed" || e.kind === "grading_ended") words += `: ${figure(e.value, 2)}`;
    if (e.impulse > 0) words += `, ${figure(e.impulse, 2)} N s`;
    if (e.undetectable) words += ", not scored: not detectable by the sensors";
    return words;
  },
  comparison: "Comparison",
  comparisonColumns: ["Session", "When (UTC)", "Points", "Fraction", "Grade", "Passed", "Penalties", "Deducted", "Time"],
  groups: { now: "this run", other: "other run", earlier: "earlier", group: "group" },
  otherScenario: (name) => `other scenario: ${name}`,
  fractionLabel: "Fraction of the points, this run among the others",
  passMark: (fraction) => `pass mark ${percent(fraction)}`,
  groupMedian: (fraction, n) => `Median of the group of ${n}: ${percent(fraction)}.`,
  figures: "Figures",
  figureRows: { score: "Points", deducted: "Deducted", deductions: "Penalties", length: "Distance driven, m", speed: "Top speed, m/s", nearest: "Smallest distance, m", seconds: "Time" },
  yes: "yes",
  no: "no",
  none: "–",
  made: (program) => `Created by ${program} from the session log alone. The log does not contain how long the server ` +
    "itself took. A delay is the arrival time minus the sender's stamp, above the smallest of the session.",
};

/// At most `digits` decimals, without trailing zeros.
function figure(value, digits) {
  const written = value.toFixed(digits);
  return (written.includes(".") ? written.replace(/\.?0+$/, "") : written).replace(/^-0$/, "0").replace("-", "−");
}

/// 1:02.3
function clock(t) {
  const tenths = Math.round(Math.max(t, 0) * 10);
  const minutes = Math.floor(tenths / 600);
  const hours = Math.floor(minutes / 60);
  const rest = ((tenths % 600) / 10).toFixed(1).padStart(4, "0");
  return hours ? `${hours}:${String(minutes % 60).padStart(2, "0")}:${rest}` : `${minutes}:${rest}`;
}

const percent = (fraction) => `${figure(100 * fraction, 1)} %`;
const day = (us) => new Date(us / 1000).toISOString().slice(0, 16).replace("T", " ");
