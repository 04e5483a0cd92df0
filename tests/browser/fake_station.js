// A station simulated in the page: the responses of /api and /ws/state, for tests and measurements of the
// page alone. Playwright loads it before the page's own scripts; `fakeStation` on the window configures the
// amount of content.
(() => {
  const options = { role: "instructor", agents: 12, beams: 361, scan_hz: 20, world_hz: 30, rooms: 3, ...globalThis.fakeStation };
  for (const [key, value] of Object.entries(options.stored ?? {})) localStorage.setItem(key, JSON.stringify(value));
  const received = (globalThis.fakeStationReceived = []);
  const room = 8, width = options.rooms * room;

  const element = (name, label, x, y, z, size, yaw = 0) => ({ name, label, at: [x, y, z], turn: [0, 0, Math.sin(yaw / 2), Math.cos(yaw / 2)], size, confidence: 1, observed: 1, virtual: false, part_of: label === "stairs" ? "stairs 1" : "", colour: [0.6, 0.6, 0.6] });
  function model() {
    const elements = [element("floor 1", "floor", width / 2, width / 2, -0.05, [width, width, 0.1])];
    let n = 0;
    const wall = (x, y, length, yaw) => elements.push(element(`wall ${++n}`, "wall", x, y, 1.25, [length, 0.12, 2.5], yaw));
    for (let i = 0; i <= options.rooms; ++i)
      for (let j = 0; j < options.rooms; ++j) {
        const outer = i === 0 || i === options.rooms;
        for (const [yaw, x, y] of [[Math.PI / 2, i * room, j * room + room / 2], [0, j * room + room / 2, i * room]]) {
          const along = (d) => [x + d * Math.cos(yaw), y + d * Math.sin(yaw)];
          if (outer) { wall(x, y, room, yaw); continue; }
          for (const side of [-1, 1]) wall(...along(side * (room / 4 + 0.25)), room / 2 - 0.5, yaw);
          elements.push(element(`lintel ${n}`, "wall_above_door", x, y, 2.3, [1, 0.12, 0.4], yaw));
          if (n % 3 === 0) elements.push(element(`door ${n}`, "door", x, y, 1.05, [0.94, 0.05, 2.05], yaw));
        }
      }
    for (let i = 0; i < 5; ++i) elements.push(element(`step ${i + 1}`, "stairs", 1.2 + 0.29 * i, 5.5, 0.085 * (i + 1), [0.29, 1.4, 0.17 * (i + 1)]));
    elements.push(element("platform 1", "floor", 3.6, 5.5, 0.42, [2, 1.4, 0.84]));
    for (let i = 0; i < options.rooms; ++i) elements.push(element(`desk ${i + 1}`, "unknown", i * room + 1.2, 1.1, 0.37, [1.4, 0.7, 0.74]), element(`pillar ${i + 1}`, "pillar", i * room + 6, 2.2, 1.25, [0.35, 0.35, 2.5]));
    for (const [name, label, x, y, z, size] of options.virtual ?? []) elements.push({ ...element(name, label, x, y, z, size), virtual: true });
    return { version: 1, map_id: "fake", elements, meshes: [] };
  }

  const shape = (kind, size, at, colour, turn = [0, 0, 0, 1]) => ({ shape: kind, size, at, turn, colour });
  const lying = [Math.SQRT1_2, 0, 0, Math.SQRT1_2];
  const rover = (colour) => [shape("box", [0.62, 0.42, 0.22], [0, 0, 0.22], colour), shape("cylinder", [0.06, 0.06, 0.12], [0.18, 0, 0.4], [0.05, 0.05, 0.06]),
    ...[[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([x, y]) => shape("cylinder", [0.12, 0.12, 0.08], [0.2 * x, 0.25 * y, 0.12], [0.03, 0.03, 0.03], lying))];
  const forms = [
    rover([0.1, 0.55, 0.6]), rover([0.75, 0.3, 0.06]),
    [shape("capsule", [0.2, 0.2, 0.45], [0, 0, 1.15], [0.1, 0.2, 0.5]), shape("sphere", [0.12, 0.12, 0.12], [0, 0, 1.66], [0.6, 0.4, 0.3]), shape("capsule", [0.08, 0.08, 0.65], [0, 0.1, 0.45], [0.05, 0.05, 0.08]), shape("capsule", [0.08, 0.08, 0.65], [0, -0.1, 0.45], [0.05, 0.05, 0.08])],
    [shape("cylinder", [0.29, 0.29, 0.88], [0, 0, 0.44], [0.05, 0.2, 0.5])],
    [shape("box", [0.5, 0.5, 0.5], [0, 0, 0.25], [0.5, 0.3, 0.1])],
  ];
  const kinds = [["robot", 1], ["person", 2], ["barrel", 3], ["box", 4]];
  const entities = [{ id: 0, name: "rover", owner: "robot", kind: "robot", robot_model: "", parts: [{ id: 0, name: "base", form: 0 }] }];
  for (let i = 1; i <= options.agents; ++i) {
    const [kind, form] = options.agents > 100 ? kinds[i % 2] : kinds[i % 4];
    entities.push({ id: i, name: `${kind} ${i}`, owner: "agent", kind, robot_model: "", parts: [{ id: i, name: "base", form }] });
  }
  const doors = options.doors ? model().elements.filter((each) => each.label === "door") : [];
  forms.push([shape("box", [0.94, 0.05, 2.05], [0.47, 0, 0], [0.4, 0.25, 0.1])]);
  for (const { name } of doors) entities.push({ id: entities.length, name, owner: "building", kind: "door", robot_model: "", parts: [{ id: entities.length, name: "leaf", form: forms.length - 1 }] });
  /** A leaf turns about one of its edges by `fakeDoors[name]`, rad. */
  const doorPlace = ({ name, at: [x, y], turn }) => {
    const closed = 2 * Math.atan2(turn[2], turn[3]);
    return [x - 0.47 * Math.cos(closed), y - 0.47 * Math.sin(closed), closed + (globalThis.fakeDoors?.[name] ?? 0)];
  };
  const place = (i, t) => {
    if (i > options.agents) return doorPlace(doors[i - options.agents - 1]);
    if (options.places?.[i]) return options.places[i];
    if (i === 0) return [4.6 + 1.9 * Math.cos(t * 0.25), 3.1 + 1.4 * Math.sin(t * 0.25), t * 0.25 + Math.PI / 2];
    const cells = Math.ceil(Math.sqrt(options.agents)), gap = (width - 1.6) / cells;
    const x = 0.8 + (((i - 1) % cells) + 0.5) * gap, y = 0.8 + (Math.floor((i - 1) / cells) + 0.5) * gap, turn = t * 0.6 + i;
    const still = i % 4 > 1 && options.agents <= 100;
    return still ? [x, y, i] : [x + Math.min(0.8, gap / 3) * Math.cos(turn), y + Math.min(0.8, gap / 3) * Math.sin(turn), turn + Math.PI / 2];
  };

  globalThis.fakePlace = (i) => place(i, options.still ? 0 : NaN);

  function world(t) {
    const view = new DataView(new ArrayBuffer(16 + 32 * entities.length));
    view.setUint8(0, 1);
    view.setUint16(2, 1, true);
    view.setUint32(4, entities.length, true);
    view.setFloat64(8, t, true);
    entities.forEach((_, i) => {
      const [x, y, yaw] = place(i, options.still ? 0 : t), at = 16 + 32 * i;
      view.setUint16(at, i, true);
      [x, y, i > options.agents ? 1.05 : 0, 0, 0, Math.sin(yaw / 2), Math.cos(yaw / 2)].forEach((value, k) => view.setFloat32(at + 4 + 4 * k, value, true));
    });
    return view.buffer;
  }
  /** Ranges to the room's walls and, for source 1, to round agents. */
  function scan(t, source) {
    const n = options.beams, view = new DataView(new ArrayBuffer(40 + 6 * n)), [x, y, yaw] = place(0, t);
    view.setUint8(0, 2);
    view.setUint8(1, source);
    view.setUint32(4, n, true);
    view.setFloat64(8, t, true);
    const rad0 = -Math.PI / 2, step = Math.PI / (n - 1);
    [x, y, yaw, rad0, step].forEach((value, k) => view.setFloat32(16 + 4 * k, value, true));
    const near = entities.slice(1).map((_, i) => [i + 1, ...place(i + 1, t)]).filter(([, ax, ay]) => Math.hypot(ax - x, ay - y) < 9);
    for (let i = 0; i < n; ++i) {
      const a = yaw + rad0 + i * step, dx = Math.cos(a), dy = Math.sin(a);
      let range = Math.min(...[[dx, x, 0.06, room - 0.06], [dy, y, 0.06, room - 0.06]].map(([d, p, low, high]) => (d > 0 ? (high - p) / d : d < 0 ? (low - p) / d : Infinity))), hit = -1;
      if (source === 1)
        for (const [id, ax, ay] of near) {
          const along = (ax - x) * dx + (ay - y) * dy, off = Math.abs((ax - x) * dy - (ay - y) * dx);
          if (along > 0 && off < 0.28 && along - 0.25 < range) { range = along - Math.sqrt(0.28 ** 2 - off ** 2); hit = id; }
        }
      view.setFloat32(40 + 4 * i, range + 0.01 * Math.sin(i * 12.9 + t), true);
      view.setInt16(40 + 4 * n + 2 * i, hit, true);
    }
    return view.buffer;
  }

  const hello = {
    type: "hello", protocol: 1, who: { name: "kim", role: options.role }, server_us: 0,
    session: { name: "workshop", mode: options.mode ?? "live", level: 3, scenario: "workshop", robot: "rover", simulated: false, started_us: 0, mapped: false },
    controls: { pause: false, rate: false, seek: false, end: true, save: true, ...options.controls },
    scene: { scripts: ["door_slams"], faults: ["camera_delay"], doors: ["door 3"], robot_models: ["rover", "crawler"], agents_max: 1000, briefing: "Drive to the platform." },
  };
  const near = (t) => Array.from({ length: 20 }, (_, i) => place(0, t + i * 0.15).slice(0, 2));

  class FakeSocket extends EventTarget {
    static CONNECTING = 0; static OPEN = 1; static CLOSING = 2; static CLOSED = 3;
    readyState = 0; binaryType = "blob"; #timers = [];
    constructor(url) {
      super();
      this.url = url;
      setTimeout(() => { this.readyState = 1; this.onopen?.({}); if (url.includes("/ws/state")) this.#state(); }, 10);
      (globalThis.fakeSockets ??= []).push(this);
    }
    send(text) { received.push(text); const message = JSON.parse(text); if (message.request !== undefined) setTimeout(() => this.give({ type: "reply", request: message.request, ok: !options.refusal, text: options.refusal ?? "done" })); }
    close(code = 1000) { this.#timers.forEach(clearInterval); this.readyState = 3; this.onclose?.({ code }); }
    give(message) { this.onmessage?.({ data: message instanceof ArrayBuffer ? message : JSON.stringify(message) }); }
    #state() {
      const started = performance.now() - 5000, t = () => (performance.now() - started) / 1000;
      this.give(hello);
      this.give({ type: "entities", table: 1, forms, list: entities });
      this.give({ type: "zones", list: [{ name: "goal", points: [[2.7, 4.9], [4.5, 4.9], [4.5, 6.1], [2.7, 6.1]], bottom: 0, top: 2 }] });
      this.give({ type: "events", list: [{ t: 3, kind: "contact_started", subject: "rover", object: "pillar 1", pair: "real_real", position: [6, 2.4, 0.2], impulse: 2, value: 0, text: "", undetectable: false, request: 0 }] });
      this.give({ type: "score", score: 12, possible: 20, passed: null, left_s: 95, tasks: [{ name: "a", title: "Reach the platform", state: "running", points: 4, of: 10, left_s: 95 }] });
      const sendStatus = () => {
        this.give({ type: "status", values: {}, notes: {}, sensors: [{ name: "SCAN", rate_hz: 20, age_ms: 12, loss: 0, state: "ok" }] });
        this.give({ type: "control", mode: options.mode ?? "live", paused: false, rate: 1, position: t(), duration: options.mode === "recorded" ? 600 : null, ended: false, frozen: false, estop: globalThis.fakeStopped ?? false, clock: performance.now() / 1000 });
        this.give({ type: "plans", list: [{ entity: "rover", kind: "predicted", points: near(t()) }, ...entities.filter((e) => e.kind === "robot" && e.id).slice(0, 6).map((e) => ({ entity: e.name, kind: "planned", points: [place(e.id, t()).slice(0, 2), place(e.id, t() + 2).slice(0, 2), place(e.id, t() + 4).slice(0, 2)] }))] });
      };
      sendStatus();
      this.#timers.push(setInterval(sendStatus, 1000), setInterval(() => this.give(world(t())), 1000 / options.world_hz),
        setInterval(() => { this.give(scan(t(), 0)); this.give(scan(t(), 1)); }, 1000 / options.scan_hz));
    }
  }
  if (!options.sockets) globalThis.WebSocket = FakeSocket;

  const really = globalThis.fetch;
  const answer = (body, status = 200) => Promise.resolve(new Response(body === null ? null : JSON.stringify(body), { status, headers: { "content-type": "application/json" } }));
  let who = options.role ? hello.who : null;
  globalThis.fetch = (url, request) => {
    const path = new URL(url, location.href).pathname;
    if (path.endsWith("/me")) return who ? answer(who) : answer({ error: "log in" }, 401);
    if (path.endsWith("/login")) {
      const { name, password } = JSON.parse(request.body);
      if (password !== "sesame") return answer({ error: "no" }, 401);
      who = { name, role: "trainee" };
      return answer(null, 204);
    }
    if (path.endsWith("/logout")) { who = null; return answer(null, 204); }
    if (path.endsWith("/model")) return answer(model());
    if (path.endsWith("/robots")) return answer({ robots: [{ name: "rover", footprint: [[0.31, 0.21], [-0.31, 0.21], [-0.31, -0.21], [0.31, -0.21]], height: 0.5, camera: { at: [0.2, 0, 0.4], turn: [-0.5, 0.5, -0.5, 0.5], width: 640, height: 480, fx: 500, fy: 500, cx: 320, cy: 240 } }], models: [] });
    if (path.includes("/api/")) return answer({ error: "there is none" }, 404);
    return really(url, request);
  };
})();
