/** Hints for new users, shown once: stored by this browser, for each role. */

class Hints {
  #seen = $state.raw<ReadonlySet<string>>(new Set(read()));

  seen(of: string): boolean {
    return this.#seen.has(of);
  }
  /** It was followed or dismissed. */
  see(of: string) {
    if (this.#seen.has(of)) return;
    this.#seen = new Set([...this.#seen, of]);
    try {
      localStorage.setItem(key, [...this.#seen].join());
    } catch { /* a browser that keeps nothing shows it again */ }
  }
}
const key = "parhelion.hints";

function read(): string[] {
  try {
    return (localStorage.getItem(key) ?? "").split(",").filter(Boolean);
  } catch {
    return [];
  }
}

export const hints = new Hints();
