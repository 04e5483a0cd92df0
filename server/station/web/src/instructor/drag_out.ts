/** A button of a palette: a click selects or deselects its tool; dragging it onto the plan places the object there. */
import { plan, toMap, type MapPoint } from "../plan/tool.svelte";

export interface DragOut {
  taken: boolean;
  /** Selects the tool, or deselects it if it is selected. */
  take(): void;
  drop(at: MapPoint): void;
}

export function dragOut(button: HTMLElement, use: DragOut) {
  let now = use, fresh = false;
  const listening = new AbortController(), { signal } = listening;
  button.addEventListener("pointerdown", (event) => {
    button.setPointerCapture(event.pointerId);
    fresh = !now.taken;
    if (fresh) now.take();
  }, { signal });
  const under = (event: PointerEvent): MapPoint | null => {
    const over = document.elementFromPoint(event.clientX, event.clientY);
    return over && button.contains(over) ? null : toMap(event.clientX, event.clientY);
  };
  button.addEventListener("pointermove", (event) => {
    const at = event.buttons & 1 ? under(event) : null;
    if (at) plan.tool?.move(at, event);
  }, { signal });
  button.addEventListener("pointerup", (event) => {
    const at = under(event);
    if (!at) return;
    plan.drafts = [];
    now.drop(at);
  }, { signal });
  button.addEventListener("click", (event) => {
    // A pointer press has handled it already; Enter and Space arrive without one. A second press deselects
    // it.
    if (event.detail === 0 || !fresh) now.take();
    fresh = false;
  }, { signal });
  return { update(next: DragOut) { now = next; }, destroy: () => listening.abort() };
}
