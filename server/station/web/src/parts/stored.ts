/** Values stored in this browser, checked when they are read: an older page may have written them. */
export function stored<T>(key: string, isValid: (value: unknown) => value is T): T | null {
  try {
    const value: unknown = JSON.parse(localStorage.getItem(key) ?? "null");
    return typeof value === "object" && value !== null && isValid(value) ? value : null;
  } catch {
    return null;
  }
}

/** null removes it. */
export function store(key: string, value: object | null) {
  try {
    if (value) localStorage.setItem(key, JSON.stringify(value));
    else localStorage.removeItem(key);
  } catch { /* a browser that keeps nothing */ }
}
