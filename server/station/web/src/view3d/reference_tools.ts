/** Tools for the plan that choose what the headset is aligned by. */
import { outline } from "../instructor/gestures";
import { plan, type Draft, type MapPoint, type PlanTool } from "../plan/tool.svelte";
import { session } from "../session/session.svelte";
import { site } from "../session/site.svelte";
import { strings } from "../strings.en";
import { faceAt, landmarkAt } from "./landmarks";
import { references, type ChosenPoint } from "./references.svelte";

const words = strings.headset;
/** m from the press to an edge, a robot's origin, or the face of a wall. */
const EDGE_M = 0.4, ROBOT_M = 0.5, FACE_M = 0.6;
/** A press this near to a chosen point removes it. */
const SAME_M = 0.25;
/** Usual height of a marker's centre above the floor, and its width, m. */
const MARKER_Z_M = 1.4, MARKER_WIDTH_M = 0.18;

/** What a hand finds there: an edge, a robot's origin, else the place itself. */
function pointAt(at: MapPoint): ChosenPoint {
  const robot = session.robots.find((name) => {
    const pose = session.poseOf(name);
    return pose && Math.hypot(pose.x - at.x, pose.y - at.y) < ROBOT_M;
  });
  const edge = site.model && landmarkAt(site.model, at, EDGE_M), pose = robot ? session.poseOf(robot) : null;
  if (edge) return edge;
  return robot && pose ? { name: robot, robot, x: pose.x, y: pose.y } : { name: words.free(at.x, at.y), x: at.x, y: at.y };
}

const draft = ({ x, y }: MapPoint, label: string): Draft => ({ points: outline({ at: { x, y }, yaw: Math.PI / 4 }, [0.2, 0.2]), closed: true, label, refused: false });
const chosen = () => references.points.map((each, i) => draft(each, `${i + 1}`));

/** A press adds the point nearest to it, or removes it. */
export function pointsTool(): PlanTool {
  const show = (at?: MapPoint) => {
    plan.drafts = [...chosen(), ...(at ? [pointAt(at)].map((each) => draft(each, each.name)) : [])];
  };
  show();
  return {
    label: words.choosePoints, how: words.pointsHow, cursor: "crosshair",
    down: show, move: show,
    up(at) {
      const point = pointAt(at), rest = references.points.filter((each) => Math.hypot(each.x - point.x, each.y - point.y) > SAME_M);
      references.change({ method: "points", points: rest.length < references.points.length ? rest : [...rest, point] });
      show();
    },
    cancel() {
      plan.drafts = [];
    },
  };
}

/** A press hangs the marker on the wall nearest to it. */
export function markerTool(): PlanTool {
  const show = (at: MapPoint) => {
    const face = site.model && faceAt(site.model, at, FACE_M);
    plan.drafts = face ? [{ ...draft(face, face.name), heading: face.yaw }] : [];
    return face;
  };
  return {
    label: words.choosePlace, how: words.placeHow, cursor: "crosshair",
    down: show, move: show,
    up(at) {
      const face = show(at), before = references.marker;
      if (!face) return;
      const { x, y, yaw, name } = face;
      references.change({ method: "marker", marker: { x, y, yaw, wall: name, z: before?.z ?? MARKER_Z_M, width_m: before?.width_m ?? MARKER_WIDTH_M } });
      plan.take(null);
    },
    cancel() {
      plan.drafts = [];
    },
  };
}
