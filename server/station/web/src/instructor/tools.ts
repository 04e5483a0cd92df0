/** Tools for the plan: place an object, or draw a path. Each is active until it is done or another one takes over. */
import { plan, type MapPoint, type PlanTool } from "../plan/tool.svelte";
import { doorAt, type DoorPlace } from "./doors";
import { outline, placement, pathWith, type Placement } from "./gestures";

interface Placing { label: string; size: readonly number[]; yaw: number; done(placement: Placement): void }

/** A press sets the position, a drag the heading, the release places the object; the tool then waits for the next
 * one. */
export function placeTool({ label, size, yaw, done }: Placing): PlanTool {
  let from: MapPoint | null = null;
  const draw = (at: MapPoint): Placement => {
    const placed = from ? placement(from, at, yaw) : { at, yaw };
    plan.drafts = [{ points: outline(placed, size), closed: true, heading: placed.yaw, label, refused: false }];
    return placed;
  };
  return {
    label, cursor: "crosshair",
    down(at) {
      from = at;
      draw(at);
    },
    move: draw,
    up(at) {
      if (!from) return;
      const placed = draw(at);
      from = null;
      plan.drafts = [];
      done(placed);
    },
    cancel() {
      plan.drafts = [];
    },
  };
}

/** A press selects a door: the one that is highlighted while the pointer is near. */
export function doorTool(label: string, how: string, places: () => DoorPlace[], done: (at: MapPoint) => void): PlanTool {
  const show = (at: MapPoint): void => {
    const found = doorAt(places(), at);
    plan.drafts = found ? [{ points: outline({ at: found, yaw: 0 }, [1, 1]), closed: true, label: found.name, refused: false }] : [];
  };
  return {
    label, how, cursor: "pointer",
    down: show, move: show,
    up(at) {
      plan.drafts = [];
      done(at);
    },
    cancel() {
      plan.drafts = [];
    },
  };
}

/** Point by point; a second press on the last point, or Enter, ends the path. */
export function pathTool(label: string, done: (path: [number, number][]) => void): PlanTool & { finish(): void } {
  let path: [number, number][] = [];
  const draw = (next?: MapPoint): void => {
    const points: [number, number][] = next ? [...path, [next.x, next.y]] : path;
    plan.drafts = points.length ? [{ points, closed: false, label: "", refused: false }] : [];
  };
  const tool = {
    label, cursor: "crosshair",
    down(at: MapPoint) {
      const longer = pathWith(path, at);
      if (!longer) return tool.finish();
      path = longer;
      draw();
    },
    move(at: MapPoint) {
      draw(at);
    },
    up() {},
    cancel() {
      plan.drafts = [];
    },
    finish() {
      plan.take(null);
      if (path.length) done(path);
    },
  };
  return tool;
}
