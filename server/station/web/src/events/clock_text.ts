/** Formats seconds of a session for people. */

/** 75.31 -> "1:15.3"; negative or unknown: "–". */
export function clockText(seconds: number | undefined, digits = 1): string {
  if (seconds === undefined || !Number.isFinite(seconds) || seconds < 0) return "–";
  const tenths = 10 ** digits;
  const rounded = Math.round(seconds * tenths) / tenths;
  const minutes = Math.floor(rounded / 60);
  const rest = (rounded - minutes * 60).toFixed(digits);
  return `${minutes}:${rest.padStart(digits ? 3 + digits : 2, "0")}`;
}

/** Remaining time, rounded up: "0:00" only when it is over. */
export function leftText(seconds: number | undefined | null): string {
  if (seconds === undefined || seconds === null || !Number.isFinite(seconds)) return "";
  return clockText(Math.ceil(Math.max(0, seconds)), 0);
}
