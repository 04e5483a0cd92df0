/** The keys of `ros2 bag play`, as in `parhelion play`: space pauses and resumes, right arrow steps by one message
 * while paused, up and down change the speed by a tenth. */

export interface PlayCommand { action: "pause" | "resume" | "step" | "rate" | "seek"; value?: number }

export interface PlayState { paused: boolean; rate: number; position: number; duration: number }

export const slowest = 0.1;
export const fastest = 10;

/** s, jump of an arrow key during playback. */
const leap = 10;
const seek = (value: number): PlayCommand => ({ action: "seek", value });

export function rateTimes(rate: number, factor: number): number {
  return Math.min(fastest, Math.max(slowest, Math.round(rate * factor * 100) / 100));
}

export function playCommand(code: string, shift: boolean, state: PlayState): PlayCommand | undefined {
  switch (code) {
    case "Space": return { action: state.paused ? "resume" : "pause" };
    case "ArrowRight": return state.paused && !shift ? { action: "step" } : seek(Math.min(state.duration, state.position + leap));
    case "ArrowLeft": return seek(Math.max(0, state.position - leap));
    case "ArrowUp": return { action: "rate", value: rateTimes(state.rate, 1.1) };
    case "ArrowDown": return { action: "rate", value: rateTimes(state.rate, 1 / 1.1) };
    case "Home": return seek(0);
    case "End": return seek(state.duration);
    default: return undefined;
  }
}
