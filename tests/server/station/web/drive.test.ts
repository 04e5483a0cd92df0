import { readingsOf } from "../../../../server/station/web/src/drive/readings";
import { HeldKeys, isTyping, takesKeys } from "../../../../server/station/web/src/drive/keys";
import { askedOf, jointCommand, movableJoints, roleOf } from "../../../../server/station/web/src/drive/joints";
import { PadDrive, type PadState } from "../../../../server/station/web/src/drive/pad";
import { beat, DriveSender } from "../../../../server/station/web/src/drive/sender";
import { knob, stickInput } from "../../../../server/station/web/src/drive/stick";
import { chosen, releasedInput, shaped, twistOf } from "../../../../server/station/web/src/drive/twist";

const press = (code: string, more = {}) => ({ code, repeat: false, ctrlKey: false, altKey: false, metaKey: false, ...more });
const limits = { vx: 1, vy: 0, wz: 2 };
const still = { vx: 0, vy: 0, wz: 0 }, none = { names: [], velocities: [] };

describe("keys", () => {
  test("a key drives while it is held, and stops when it is let go", () => {
    const keys = new HeldKeys();
    keys.press(press("KeyW"));
    expect(keys.input()).toEqual({ held: true, forward: 1, left: 0, turn: 0 });
    keys.press(press("ArrowLeft"));
    expect(keys.input()).toEqual({ held: true, forward: 1, left: 0, turn: 1 });
    keys.release("KeyW");
    keys.release("ArrowLeft");
    expect(keys.input()).toEqual(releasedInput);
  });
  test("two keys for one way are held until both are let go", () => {
    const keys = new HeldKeys();
    keys.press(press("KeyW"));
    keys.press(press("ArrowUp"));
    keys.release("KeyW");
    expect(keys.input().forward).toBe(1);
  });
  test("backwards the wheel turns as a car's", () => {
    const keys = new HeldKeys();
    keys.press(press("KeyS"));
    keys.press(press("KeyA"));
    expect(keys.input()).toEqual({ held: true, forward: -1, left: 0, turn: -1 });
  });
  test("a repeat after the page lost the keyboard does not drive on: the key must be pressed anew", () => {
    const keys = new HeldKeys();
    keys.press(press("KeyW"));
    keys.releaseAll();
    keys.press(press("KeyW", { repeat: true }));
    expect(keys.input().held).toBe(false);
    keys.press(press("KeyW"));
    expect(keys.input().held).toBe(true);
  });
  test("a shortcut of the browser is none of ours", () => {
    const keys = new HeldKeys();
    expect(keys.press(press("KeyW", { ctrlKey: true }))).toBeUndefined();
    expect(keys.input().held).toBe(false);
  });
  test("what is written into takes keys; a slider takes arrows, yet Space on it still stops", () => {
    expect(isTyping({ tagName: "INPUT", type: "text" })).toBe(true);
    expect(isTyping({ tagName: "INPUT", type: "range" })).toBe(false);
    expect(takesKeys({ tagName: "INPUT", type: "range" })).toBe(true);
    expect(takesKeys({ tagName: "BUTTON" })).toBe(false);
    expect(takesKeys({ tagName: "BUTTON", role: "tab" })).toBe(true);
  });
});

function pad(axes: number[], ...down: number[]): PadState {
  return { axes, buttons: Array.from({ length: 17 }, (_, i) => ({ pressed: down.includes(i), value: down.includes(i) ? 1 : 0 })) };
}

describe("game pad", () => {
  test("drives only while the left shoulder button is held, which was seen let go before", () => {
    const drive = new PadDrive();
    expect(drive.command(pad([0, -1, 0, 0], 4)).drive.held).toBe(false);  // held when it was plugged in
    drive.command(pad([0, -1, 0, 0]));
    expect(drive.command(pad([0, -1, 0, 0], 4)).drive).toEqual({ held: true, forward: 1, left: 0, turn: 0 });
    expect(drive.command(pad([-1, 0, 0, 0], 4)).drive.turn).toBe(1);
    expect(drive.command(pad([0, -1, 0, 0])).drive).toEqual(releasedInput);
  });
  test("one that was unplugged while it drove must be let go first", () => {
    const drive = new PadDrive();
    drive.command(pad([]));
    drive.command(pad([0, -1, 0, 0], 4));
    drive.command(null);
    expect(drive.command(pad([0, -1, 0, 0], 4)).drive.held).toBe(false);
  });
  test("the other shoulder slows, buttons move joints, and a press counts once", () => {
    const drive = new PadDrive();
    drive.command(pad([]));
    const slow = drive.command(pad([0, -1, 1, 0], 4, 5, 12, 9));
    expect(slow.drive.forward).toBeCloseTo(1 / 3);
    expect(slow.joints.elbow).toBeCloseTo(1 / 3);
    expect(slow.joints.turret).toBeCloseTo(-1 / 3);
    expect(slow.nextRobot).toBe(true);
    expect(drive.command(pad([], 4, 9)).nextRobot).toBe(false);
  });
  test("a stick that rests off the middle does not creep", () => {
    expect(shaped(0.1)).toBe(0);
    expect(shaped(1)).toBe(1);
    expect(shaped(-1)).toBe(-1);
    expect(shaped(NaN)).toBe(0);
    expect(shaped(0.5)).toBeLessThan(0.5);
  });
});

describe("stick on the screen", () => {
  const well = { x: 100, y: 100, radius: 50 };
  test("forward is up, left is left; beyond the well it is at its end", () => {
    expect(stickInput(knob(well, 100, 0))).toEqual({ held: true, forward: 1, left: 0, turn: 0 });
    expect(stickInput(knob(well, 0, 100)).turn).toBe(1);
    expect(stickInput(null)).toEqual(releasedInput);
  });
  test("a well of no size asks for nothing", () => {
    expect(stickInput(knob({ x: 0, y: 0, radius: 0 }, 0, 0))).toMatchObject({ forward: 0, turn: 0 });
  });
});

describe("twist", () => {
  test("is a fraction of what the robot may do", () => {
    expect(twistOf({ held: true, forward: 1, left: 0, turn: -0.5 }, limits, 5)).toEqual({ vx: 0.5, vy: 0, wz: -0.5 });
    expect(twistOf({ held: true, forward: NaN, left: 7, turn: 9 }, limits, 99)).toEqual({ vx: 0, vy: 0, wz: 2 });
    expect(twistOf({ held: false, forward: 1, left: 1, turn: 1 }, limits, 10)).toEqual(still);
  });
  test("two devices do not add up: the first that is held drives", () => {
    const one = { held: true, forward: 1, left: 0, turn: 0 };
    expect(chosen([releasedInput, one, { ...one, forward: -1 }])).toBe(one);
    expect(chosen([releasedInput])).toEqual(releasedInput);
  });
});

describe("sender", () => {
  const types = (messages: { type: string }[]) => messages.map((each) => each.type);
  test("says at once what is new, repeats it, and lets go once", () => {
    const sender = new DriveSender(), forward = { vx: 1, vy: 0, wz: 0 };
    expect(types(sender.step(0, false, still, none))).toEqual(["release"]);  // the server waits for a release
    expect(sender.step(1, false, still, none)).toEqual([]);
    expect(sender.step(100, true, forward, none)).toEqual([{ type: "twist", seq: 1, at_ms: 100, ...forward }]);
    expect(sender.step(100 + beat - 1, true, forward, none)).toEqual([]);
    expect(types(sender.step(100 + beat, true, forward, none))).toEqual(["twist"]);
    expect(types(sender.step(100 + beat + 10, true, { ...forward, wz: 1 }, none))).toEqual(["twist"]);
    expect(types(sender.step(300, false, still, none))).toEqual(["release"]);
    expect(sender.step(301, false, still, none)).toEqual([]);
  });
  test("a thumb that trembles does not flood", () => {
    const sender = new DriveSender();
    let sent = 0;
    for (let now = 0; now < 1000; ++now) sent += sender.step(now, true, { vx: now / 1000, vy: 0, wz: 0 }, none).length;
    expect(sent).toBeLessThanOrEqual(100);
  });
  test("a joint that stops while the robot drives is told so, and both go on being said", () => {
    const sender = new DriveSender(), drive = { vx: 1, vy: 0, wz: 0 };
    sender.step(0, true, drive, { names: ["elbow"], velocities: [0.5] });
    expect(sender.step(20, true, drive, none)).toEqual([{ type: "joints", seq: 3, at_ms: 20, names: ["elbow"], velocities: [0] }]);
    expect(types(sender.step(20 + beat, true, drive, none))).toEqual(["twist", "joints"]);
  });
  test("a joint alone is held as driving is: the wheels are told to stand", () => {
    const sender = new DriveSender();
    const [twist, joints] = sender.step(0, false, still, { names: ["elbow"], velocities: [0.5] });
    expect(twist).toMatchObject({ type: "twist", vx: 0, wz: 0 });
    expect(joints).toMatchObject({ type: "joints", names: ["elbow"] });
    expect(types(sender.step(1, false, still, none))).toEqual(["release"]);
  });
  test("after the server stopped it, a release is owed", () => {
    const sender = new DriveSender();
    sender.step(0, false, still, none);
    sender.restart();
    expect(types(sender.step(1, false, still, none))).toEqual(["release"]);
  });
});

describe("readings", () => {
  test("rates, doses, battery and radio are told apart", () => {
    const hazard = [{ kind: "radiation", value: 12.34, unit: "uSv/h" }, { kind: "gas", value: 0.5, unit: "ppm" },
      { kind: "radiation", value: 1, unit: "uSv" }, { kind: "gas", value: 1234, unit: "ppm min" }] as const;
    expect(readingsOf([...hazard], { battery_left: 0.456, radio_dbm: -61.2 }).map((each) => `${each.name}: ${each.text}`)).toEqual(
      ["radiation: 12.3 µSv/h", "gas: 0.5 ppm", "dose: 1 µSv", "gasDose: 1234 ppm min", "battery: 46 %", "radio: -61 dBm"]);
  });
  test("what is not measured is not shown", () => expect(readingsOf([], {})).toEqual([]));
});

describe("joints", () => {
  test("two flippers move as one too", () => {
    const [left, right, arm] = [{ name: "left_flipper_joint" }, { name: "right_flipper_joint" }, { name: "elbow_joint" }];
    expect(movableJoints([left, arm])).toEqual([{ name: left.name, joints: [left] }, { name: arm.name, joints: [arm] }]);
    expect(movableJoints([left, right, arm]).map((each) => each.joints)).toEqual([[left, right], [left], [right], [arm]]);
  });
  const joints = [{ name: "turret_joint" }, { name: "left_finger_joint", kind: "prismatic" }, { name: "left_flipper_joint", speed: 0.6 }, { name: "camera_pan_joint" }];
  test("are known by their names", () => {
    expect(joints.map((each) => roleOf(each.name))).toEqual(["turret", "gripper", "flippers", "head"]);
    expect(roleOf("q7")).toBe("other");
  });
  test("what the pad asks goes to those of that use, at their speed", () => {
    const pads = { turret: 1, shoulder: 0, elbow: 0, wrist: 0, gripper: -1, flippers: 0.5 };
    expect(jointCommand(joints, askedOf(joints, pads, new Map([["camera_pan_joint", 1]])))).toEqual({
      names: ["turret_joint", "left_finger_joint", "left_flipper_joint", "camera_pan_joint"], velocities: [0.5, -0.05, 0.3, 0.5],
    });
  });
  test("those that stand are not named", () => {
    expect(jointCommand(joints, new Map([["turret_joint", 0]]))).toEqual({ names: [], velocities: [] });
  });
});
