/** The user's selection, shared by all panels. */
import type { Entity } from "./protocol";
import { session } from "./session.svelte";

class Selection {
  /** The robot whose video is shown and that is driven, by name; empty: the session's own. */
  robot = $state("");
  /** Name of the selected entity, or empty. */
  entity = $state("");
  /** Centres the views here (map, m); a new object each time. */
  place = $state.raw<{ x: number; y: number } | null>(null);

  entityRow: Entity | undefined = $derived(session.entities.find((each) => each.name === this.entity));

  showPlace(x: number, y: number) {
    this.place = { x, y };
  }
}

export const selection = new Selection();
