// Keyboard navigation of a page: Tab reaches every control, the focus is visible, and there is no focus trap.
import assert from "node:assert/strict";

/** Runs in the page: the focused element, and whether the focus is visible. */
function focused() {
  let here = document.activeElement;
  if (!here || here === document.body) return null;
  const style = getComputedStyle(here), box = here.getBoundingClientRect();
  globalThis.walkIds ??= new WeakMap();
  globalThis.walkCount ??= 0;
  if (!globalThis.walkIds.has(here)) globalThis.walkIds.set(here, ++globalThis.walkCount);
  return {
    id: globalThis.walkIds.get(here),
    what: `${here.tagName.toLowerCase()} "${(here.getAttribute("aria-label") ?? here.textContent ?? "").trim().slice(0, 40)}"`,
    marked: style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 1,
    onScreen: box.right > 0 && box.bottom > 0 && box.left < innerWidth && box.top < innerHeight,
  };
}

/** Runs in the page: all controls now; of tabs, the selected one represents all. */
function note() {
  globalThis.walkFrom = [...document.querySelectorAll("button, a[href], input, select, textarea, summary, [tabindex]")];
}

/** Runs in the page: controls present throughout that were not reached. */
function missed(reached) {
  const ids = new Set(reached);
  const pressable = (each) => each.isConnected && !each.disabled && each.tabIndex >= 0 && each.checkVisibility({ visibilityProperty: true });
  return globalThis.walkFrom.filter((each) => pressable(each) && !ids.has(globalThis.walkIds.get(each))).map((each) => `${each.tagName.toLowerCase()} "${(each.getAttribute("aria-label") ?? each.textContent ?? "").trim().slice(0, 40)}"`);
}

/** One round of Tab from any start; the reached controls in order. `maxPresses`: presses until it counts as a trap. */
export async function walkByKeys(page, what, maxPresses = 250) {
  await page.evaluate(note);
  const seen = [];
  for (let presses = 0; ; ++presses) {
    assert.ok(presses < maxPresses, `${what}: Tab does not come round; it goes by ${seen.slice(-4).map((each) => each.what).join(", ")}`);
    await page.keyboard.press("Tab");
    const now = await page.evaluate(focused);
    if (!now) continue;  // the focus left the page; the next Tab enters at its top
    if (now.id === seen[0]?.id) break;
    assert.notEqual(now.id, seen.at(-1)?.id, `${what}: Tab stays on ${now.what}`);
    assert.ok(now.marked, `${what}: nobody sees that ${now.what} has the focus`);
    assert.ok(now.onScreen, `${what}: ${now.what} has the focus and is off the screen`);
    seen.push(now);
  }
  assert.deepEqual(await page.evaluate(missed, seen.map((each) => each.id)), [], `${what}: Tab never comes by`);
  return seen;
}
