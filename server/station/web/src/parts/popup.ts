/** A menu that hangs from its button: it is open only while somebody is in it. Escape closes it and means nothing else. */

/** As the page stands now: a `details`, or what holds a button that says it has expanded. */
const isOpen = (root: Element): boolean => (root instanceof HTMLDetailsElement ? root.open : root.querySelector("[aria-expanded=true]") !== null);

/** What has the focus is in an open one: its Escape is not the emergency stop. */
export function inPopup(target: EventTarget | null): boolean {
  const root = target instanceof Element ? target.closest("[data-popup]") : null;
  return root !== null && isOpen(root);
}

const drives = /^Key[WASD]$/;

/** On the element that holds the button and what hangs from it. */
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
