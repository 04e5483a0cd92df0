/** Shortcuts of the page in one list, so that none is used twice and `?` can show them. */
import { dialogues } from "./dialogue.svelte";

export interface KeyUse { key: string; what: string; run(): void }

const uses = new Map<string, KeyUse>();

/** Returns a function that removes it. Disabled during text input. Driving keys are in drive/keys.ts. */
export function useKey(use: KeyUse): () => void {
  const key = use.key.toLowerCase();
  uses.set(key, use);
  return () => { if (uses.get(key) === use) uses.delete(key); };
}

export const usedKeys = (): KeyUse[] => [...uses.values()];

export const typesIn = (target: EventTarget | null) =>
  target instanceof HTMLElement && (target.isContentEditable || /^(INPUT|SELECT|TEXTAREA)$/.test(target.tagName) && (target as HTMLInputElement).type !== "checkbox");

export function handleKey(event: KeyboardEvent) {
  if (dialogues.open || event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented || typesIn(event.target)) return;
  const use = uses.get(event.key.toLowerCase());
  if (!use) return;
  event.preventDefault();
  use.run();
}
