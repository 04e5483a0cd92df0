/** Tools of other panels on the plan: a tool takes the pointer, drafts are drawn on top. Metres in map. */

export interface MapPoint { x: number; y: number }
export interface PlanTool {
  /** Short description of the pointer's function; shown over the plan and read by screen readers. */
  label: string;
  /** Instruction, if it is not to press, and drag to turn. */
  how?: string;
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

/** Map position of a window point; null: not in this view. */
type Converter = (clientX: number, clientY: number) => MapPoint | null;
const converters = new Set<Converter>();

/** Registered by each view of the site while it is shown; returns a function that removes it. */
export function showsSite(convert: Converter): () => void {
  converters.add(convert);
  return () => { converters.delete(convert); };
}
/** null: in no view of the site. */
export function toMap(clientX: number, clientY: number): MapPoint | null {
  for (const convert of converters) {
    const at = convert(clientX, clientY);
    if (at) return at;
  }
  return null;
}
