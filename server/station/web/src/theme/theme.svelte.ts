/** The selected colour scheme; stored in this browser. */
export type Theme = "auto" | "light" | "dark" | "contrast";
export const themes: Theme[] = ["auto", "light", "dark", "contrast"];
const KEY = "parhelion.theme";
const asks = (query: string) => matchMedia(query);

class ThemeStore {
  chosen = $state<Theme>(stored());
  #light = $state(asks("(prefers-color-scheme: light)").matches);
  #contrast = $state(asks("(prefers-contrast: more)").matches);
  shown: Exclude<Theme, "auto"> = $derived(
    this.chosen !== "auto" ? this.chosen : this.#contrast ? "contrast" : this.#light ? "light" : "dark");

  constructor() {
    asks("(prefers-color-scheme: light)").addEventListener("change", (e) => { this.#light = e.matches; });
    asks("(prefers-contrast: more)").addEventListener("change", (e) => { this.#contrast = e.matches; });
  }

  choose(theme: Theme) {
    this.chosen = theme;
    try { localStorage.setItem(KEY, theme); } catch { /* a browser that keeps nothing */ }
  }

  next() {
    this.choose(themes[(themes.indexOf(this.chosen) + 1) % themes.length] ?? "auto");
  }
}

function stored(): Theme {
  try {
    const kept = localStorage.getItem(KEY) as Theme | null;
    return kept && themes.includes(kept) ? kept : "auto";
  } catch {
    return "auto";
  }
}

export const theme = new ThemeStore();

/** The scheme's colours for a canvas, by their names in theme.css without the dashes. */
export function colours<Name extends string>(...names: Name[]): Record<Name, string> {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()])) as Record<Name, string>;
}
