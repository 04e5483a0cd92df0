import { clockText, leftText } from "../../../../server/station/web/src/events/clock_text";
import { eventGroups, filtered, groupOf, seekMarks, weightOf } from "../../../../server/station/web/src/events/kinds";
import { detailOf, nameOfEvent } from "../../../../server/station/web/src/events/words";
import type { SessionEvent } from "../../../../server/station/web/src/session/protocol";
import { strings } from "../../../../server/station/web/src/strings.en";
import { countsOf, stagesOf } from "../../../../server/station/web/src/events/stages";
import { doorAt } from "../../../../server/station/web/src/instructor/doors";
import { outline, placement, pathWith } from "../../../../server/station/web/src/instructor/gestures";
import { faultCommand } from "../../../../server/station/web/src/instructor/faults";
import { door, freeName, lacksPath, palette, spawn, standStill } from "../../../../server/station/web/src/instructor/palette";
import { fixed, headingText } from "../../../../server/station/web/src/parts/fixed";
import { playCommand } from "../../../../server/station/web/src/play/keys";

const event = (t: number, kind: string, more = {}) =>
  ({ t, kind, subject: "rover", object: "", position: null, impulse: 0, value: 0, text: "", undetectable: false, request: 0, ...more });

describe("events", () => {
  const events = [event(1, "contact_started", { object: "person_1" }), event(2, "score_changed"), event(3, "agent_spawned"), event(4, "task_done", { object: "through the door" })];
  const every = new Set(eventGroups);
  test("the newest comes first; what is said often only where it is asked for", () => {
    expect(filtered(events, { groups: every, all: false, text: "" }).map((each) => each.t)).toEqual([4, 3, 1]);
    expect(filtered(events, { groups: every, all: true, text: "" }).length).toBe(4);
  });
  test("are found by group and by all the words that are typed", () => {
    expect(filtered(events, { groups: new Set(["contact"] as const), all: true, text: "" }).map((each) => each.t)).toEqual([1]);
    expect(filtered(events, { groups: every, all: true, text: "Door rover" }).map((each) => each.t)).toEqual([4]);
    expect(filtered(events, { groups: every, all: true, text: "spawned" }).map((each) => each.t)).toEqual([3]);
  });
  test("a kind of a newer server is shown, not lost", () => {
    expect(groupOf("volcano")).toBe("session");
    expect(weightOf("volcano")).toBe("plain");
  });
  test("marks of a seek bar do not crowd", () => {
    const many = Array.from({ length: 100 }, (_, i) => event(i / 10, "points_deducted"));
    expect(seekMarks(many, 1).length).toBe(10);
    expect(seekMarks([event(1, "agent_moved")], 1)).toEqual([]);
  });
});

test("times read as clocks", () => {
  expect(clockText(75.31)).toBe("1:15.3");
  expect(clockText(59.96)).toBe("1:00.0");
  expect(clockText(0, 0)).toBe("0:00");
  expect(clockText(NaN)).toBe("–");
  expect(leftText(0.2)).toBe("0:01");
  expect(leftText(-3)).toBe("0:00");
  expect(leftText(null)).toBe("");
});

test("figures of the server become stages and counts; what was never measured is left out", () => {
  const values = { scan_us_p50: 900, scan_us_p99: 2500, frame_us_p50: null, scans_in: 12 };
  expect(stagesOf(values)).toEqual([{ name: "scan_us", p50: 0.9, p99: 2.5 }]);
  expect(countsOf(values)).toEqual([["scans_in", 12]]);
});

describe("what an instructor does", () => {
  test("a drag turns, a click keeps the heading", () => {
    expect(placement({ x: 1, y: 1 }, { x: 1, y: 3 }, 0).yaw).toBeCloseTo(Math.PI / 2);
    expect(placement({ x: 1, y: 1 }, { x: 1.05, y: 1 }, 2)).toEqual({ at: { x: 1, y: 1 }, yaw: 2 });
  });
  test("the draft has the size and heading of the thing", () => {
    const [corner] = outline({ at: { x: 5, y: 0 }, yaw: Math.PI / 2 }, [2, 1]);
    expect(corner![0]).toBeCloseTo(4.5);
    expect(corner![1]).toBeCloseTo(1);
  });
  test("a way ends with a second press on its last point", () => {
    const path = pathWith(pathWith([], { x: 0, y: 0 })!, { x: 2, y: 0 })!;
    expect(path).toEqual([[0, 0], [2, 0]]);
    expect(pathWith(path, { x: 2.05, y: 0 })).toBeNull();
  });
  test("a name is one that is free", () => {
    const person = palette([])[0]!;
    expect(freeName(person, new Set(["person_1", "person_3"]))).toBe("person_2");
  });
  test("a person is told what to do, a box only where to stand", () => {
    const [person, , , box] = palette(["crawler"]);
    expect(spawn(person!, "person_1", { x: 1.23456, y: 2 }, 0, { ...standStill, behaviour: "patrol", waypoints: [[1, 2], [3, 4]] })).toEqual({
      type: "agent", action: "spawn", name: "person_1", kind: "person", x: 1.235, y: 2, z: 0, yaw: 0,
      behaviour: "patrol", speed: 0.5, yields: true, opens_doors: true, waypoints: [[1, 2], [3, 4]],
    });
    expect(spawn(box!, "box_1", { x: 0, y: 0 }, 1, standStill)).toEqual({ type: "agent", action: "spawn", name: "box_1", kind: "box", x: 0, y: 0, z: 0, yaw: 1, size: [0.4, 0.4, 0.6] });
  });
  test("a door is open so far, or as it is sensed", () => {
    expect(door("door 1", 1.5)).toMatchObject({ action: "door", opening: 1.5 });
    expect(door("door 1", undefined)).toEqual({ type: "agent", action: "door_unknown", name: "door 1" });
  });
  test("the door that is meant is the nearest within reach", () => {
    const doors = [{ name: "door 1", x: 0, y: 0 }, { name: "door 2", x: 2, y: 0 }];
    expect(doorAt(doors, { x: 1.2, y: 0.3 })?.name).toBe("door 2");
    expect(doorAt(doors, { x: 0, y: 1.6 })).toBeNull();
    expect(doorAt([], { x: 0, y: 0 })).toBeNull();
  });
  test("faults go out in seconds and fractions, within their bounds", () => {
    expect(faultCommand({ kind: "camera_delay", amount: 200, side: "left", lasting: 30 })).toEqual({ type: "fault", kind: "camera_delay", on: true, amount: 0.2, lasting: 30 });
    expect(faultCommand({ kind: "camera_loss", amount: 400, side: "left", lasting: 0 })).toEqual({ type: "fault", kind: "camera_loss", on: true, amount: 0.9 });
    expect(faultCommand({ kind: "dead_wheel", amount: 0, side: "right", lasting: 0 })).toEqual({ type: "fault", kind: "dead_wheel", on: true, side: "right" });
  });
});

test("the keys of ros2 bag play", () => {
  const state = { paused: true, rate: 1, position: 5, duration: 60 };
  expect(playCommand("Space", false, state)).toEqual({ action: "resume" });
  expect(playCommand("ArrowRight", false, state)).toEqual({ action: "step" });
  expect(playCommand("ArrowUp", false, state)).toEqual({ action: "rate", value: 1.1 });
  expect(playCommand("ArrowDown", false, { ...state, rate: 0.1 })).toEqual({ action: "rate", value: 0.1 });
  expect(playCommand("ArrowRight", true, { ...state, position: 55 })).toEqual({ action: "seek", value: 60 });
  expect(playCommand("ArrowRight", false, { ...state, paused: false })).toEqual({ action: "seek", value: 15 });
  expect(playCommand("ArrowLeft", false, state)).toEqual({ action: "seek", value: 0 });
  expect(playCommand("KeyQ", false, state)).toBeUndefined();
});

test("every event's name begins like a sentence", () => {
  for (const kind of [...Object.keys(strings.eventKinds), "zone_entered", "step_climbed", "a_kind_of_a_later_server"])
    expect(nameOfEvent({ kind })).toMatch(/^[A-Z][^_]*$/);
});

test("a task's event names the robot where several have the same tasks", () => {
  const done = { t: 1, kind: "task_done", subject: "rover_2", object: "at the barrel", impulse: 0, text: "" } as SessionEvent;
  expect(detailOf(done)).toBe("at the barrel");
  expect(detailOf(done, true)).toBe("rover_2 – at the barrel");
});

test("who drives is called by the role: names of pages on the bus are numbers", () => {
  const of = (subject: string) => detailOf({ t: 1, kind: "operator_switched", subject, object: "robot_1", impulse: 0, text: "browser" } as SessionEvent);
  expect(of("trainee_74142a")).toBe("Trainee – robot_1 · browser");
  expect(of("joystick_1")).toBe("joystick_1 – robot_1 · browser");
});

test("what is rounded to zero has no sign, and half a turn one name", () => {
  expect([fixed(-0.004, 2), fixed(-0, 0), fixed(-0.006, 2), fixed(1.5, 1)]).toEqual(["0.00", "0", "-0.01", "1.5"]);
  const degrees = (value: number) => headingText((value * Math.PI) / 180);
  expect([-0.3, 0.3, -180, 180, -179.7, -90, 540, -200].map(degrees)).toEqual(["0°", "0°", "180°", "180°", "180°", "-90°", "180°", "160°"]);
});

test("who is to walk a path needs one", () => {
  for (const behaviour of ["patrol", "go"] as const) {
    expect(lacksPath({ ...standStill, behaviour })).toBe(true);
    expect(lacksPath({ ...standStill, behaviour, waypoints: [[1, 2]] })).toBe(false);
  }
  expect(lacksPath({ ...standStill, behaviour: "wander" })).toBe(false);
});
