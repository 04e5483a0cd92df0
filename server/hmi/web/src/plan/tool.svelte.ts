/** What other panels do on the plan: a tool takes the pointer, drafts are drawn on top. Metres in map. */

export interface MapPoint { x: number; y: number }
export interface PlanTool {
  /** What the pointer does now, in a few words; shown over the plan and read out. */
  label: string;
  cursor: string;
  down(p: MapPoint, event: PointerEvent | KeyboardEvent): void;
  move(p: MapPoint, event: PointerEvent | KeyboardEvent): void;
  up(p: MapPoint, event: PointerEvent | KeyboardEvent): void;
  /** Escape, or another tool takes over. */
  cancel(): void;
}
export interface Draft { points: [number, number][]; closed: boolean; heading?: number; label: string; refused: boolean }

class PlanState {
  tool = $state.raw<PlanTool | null>(null);
  drafts = $state.raw<Draft[]>([]);

  take(tool: PlanTool | null) {
    const before = this.tool;
    this.tool = tool;
    if (before && before !== tool) before.cancel();
  }
}

export const plan = new PlanState();

/** Set by the plan view while it is shown; null outside it. */
let converter: ((clientX: number, clientY: number) => MapPoint | null) | null = null;
export function showsPlan(convert: typeof converter) {
  converter = convert;
}
/** Where on the map a point of the window is; null: not on the plan. */
export function toMap(clientX: number, clientY: number): MapPoint | null {
  return converter?.(clientX, clientY) ?? null;
}
