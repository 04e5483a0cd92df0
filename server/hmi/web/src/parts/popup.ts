/** A menu that hangs from its button: it is open only while somebody is in it. Escape closes it and means nothing else. */

/** What has the focus is in one: its Escape is not the emergency stop. */
export const inPopup = (target: EventTarget | null): boolean => target instanceof Element && target.closest("[data-popup]") !== null;

const drives = /^Key[WASD]$/;

/** On the element that holds the button and what hangs from it; `close` is called while it is open, too often at the worst. */
export function popup(root: HTMLElement, { open, close }: { open: boolean; close(): void }) {
  let now = { open, close };
  const mark = () => root.toggleAttribute("data-popup", now.open);
  const inside = (target: EventTarget | null) => target instanceof Node && root.contains(target);
  const leave = (event: FocusEvent) => { if (now.open && event.relatedTarget && !inside(event.relatedTarget)) now.close(); };
  const press = (event: PointerEvent) => { if (now.open && !inside(event.target)) now.close(); };
  const key = (event: KeyboardEvent) => {
    if (!now.open) return;
    if (drives.test(event.code)) return now.close();  // whoever drives is no more in a menu
    if (event.key !== "Escape") return;
    event.preventDefault();
    event.stopPropagation();
    now.close();
    root.querySelector<HTMLElement>("button, summary")?.focus();
  };
  mark();
  root.addEventListener("focusout", leave);
  root.addEventListener("keydown", key);
  addEventListener("pointerdown", press);
  return {
    update(next: { open: boolean; close(): void }) {
      now = next;
      mark();
    },
    destroy() {
      root.removeEventListener("focusout", leave);
      root.removeEventListener("keydown", key);
      removeEventListener("pointerdown", press);
    },
  };
}
