import { assumed, calibrated, inHeadset } from "../../../../server/station/web/src/view3d/calibration";

const robot = { x: 3, y: -1.5, yaw: 0.7 };

test("the robot lies under the controller that was held over it, and looks where that pointed", () => {
  for (const heading of [0, 0.7, -2, 3.1]) {
    const hand = { x: 0.4, y: 1.1, z: -1.3 }, pointing = { x: Math.cos(heading), y: -0.4, z: -Math.sin(heading) };
    const found = calibrated(hand, pointing, robot);
    if (!found) throw new Error("not found");
    const at = inHeadset(found, robot.x, robot.y, 0), ahead = inHeadset(found, robot.x + Math.cos(robot.yaw), robot.y + Math.sin(robot.yaw), 0);
    expect(at.x).toBeCloseTo(hand.x);
    expect(at.z).toBeCloseTo(hand.z);
    expect(at.y).toBe(0);
    expect(Math.atan2(-(ahead.z - at.z), ahead.x - at.x)).toBeCloseTo(Math.atan2(Math.sin(heading), Math.cos(heading)));
  }
});

test("lengths and heights stay what they are", () => {
  const place = assumed(robot), a = inHeadset(place, 1, 2, 0.5), b = inHeadset(place, 4, 6, 1.5);
  expect(Math.hypot(a.x - b.x, a.z - b.z)).toBeCloseTo(5);
  expect(b.y - a.y).toBeCloseTo(1);
});

test("the site is not mirrored: left of the robot is left", () => {
  const place = assumed({ x: 0, y: 0, yaw: 0 });  // looks away from the wearer
  expect(inHeadset(place, 0, 1, 0).x).toBeCloseTo(-1);
  expect(inHeadset(place, 1, 0, 0).z).toBeCloseTo(-3);
});

test("a controller that points at the floor says nothing of the heading", () => {
  expect(calibrated({ x: 0, y: 1, z: 0 }, { x: 0.01, y: -1, z: 0 }, robot)).toBeNull();
});
