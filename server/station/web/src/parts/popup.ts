/** A menu attached to its button: open only while the focus is in it. Escape only closes it. */

/** State of the DOM: an open `details`, or an element with a button that is expanded. */
const isOpen = (root: Element): boolean => (root instanceof HTMLDetailsElement ? root.open : root.querySelector("[aria-expanded=true]") !== null);

const drives = /^Key[WASD]$/;

/** For the element that contains the button and the menu. */
export function popup(root: HTMLElement, close: () => void) {
  const listening = new AbortController(), { signal } = listening;
  const inside = (target: EventTarget | null) => target instanceof Node && root.contains(target);
  root.toggleAttribute("data-popup", true);
  root.addEventListener("focusout", ({ relatedTarget }) => { if (isOpen(root) && relatedTarget && !inside(relatedTarget)) close(); }, { signal });
  addEventListener("pointerdown", ({ target }) => { if (isOpen(root) && !inside(target)) close(); }, { signal });
  root.addEventListener("keydown", (event) => {
    if (!isOpen(root)) return;
    if (drives.test(event.code)) return close();  // a driving key closes the menu
    if (event.key !== "Escape") return;
    event.preventDefault();
    event.stopPropagation();
    close();
    root.querySelector<HTMLElement>("button, summary")?.focus();
  }, { signal });
  return { destroy: () => listening.abort() };
}
