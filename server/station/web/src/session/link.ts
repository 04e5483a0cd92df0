/** One WebSocket that reconnects with growing pauses and reports how long it has been silent. */

export type LinkState = "connecting" | "open" | "lost" | "refused";
export interface LinkHandlers {
  text(text: string): void;
  bytes(bytes: ArrayBuffer): void;
  state(state: LinkState, retryAt: number): void;
}
export const FIRST_PAUSE_MS = 300, LONGEST_PAUSE_MS = 8000;
/** Close codes after which reconnecting is useless until someone logs in again. */
const REFUSALS = [4401, 4403, 1008];

export const pauseAfter = (failures: number) => Math.min(LONGEST_PAUSE_MS, FIRST_PAUSE_MS * 2 ** failures);

export class Link {
  #socket: WebSocket | null = null;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #failures = 0;
  #wanted = false;
  /** performance.now() of the last message; 0: none yet. */
  receivedAt = 0;

  constructor(private readonly path: string, private readonly handlers: LinkHandlers) {}

  open() {
    this.close();
    this.#wanted = true;
    this.#connect();
  }

  close() {
    this.#wanted = false;
    clearTimeout(this.#timer);
    const socket = this.#socket;
    this.#socket = null;
    socket?.close(1000);
  }

  /** False: not connected, nothing was sent. */
  send(message: string | ArrayBuffer): boolean {
    if (this.#socket?.readyState !== WebSocket.OPEN) return false;
    this.#socket.send(message);
    return true;
  }

  #connect() {
    this.handlers.state("connecting", 0);
    const socket = new WebSocket(socketAddress(this.path, location));
    socket.binaryType = "arraybuffer";
    this.#socket = socket;
    socket.onopen = () => {
      if (socket !== this.#socket) return;
      this.handlers.state("open", 0);
    };
    socket.onmessage = ({ data }) => {
      if (socket !== this.#socket) return;
      this.receivedAt = performance.now();
      this.#failures = 0;
      if (typeof data === "string") this.handlers.text(data);
      else this.handlers.bytes(data as ArrayBuffer);
    };
    socket.onclose = ({ code }) => {
      if (socket !== this.#socket || !this.#wanted) return;
      this.#socket = null;
      if (REFUSALS.includes(code)) return this.handlers.state("refused", 0);
      const pause = pauseAfter(this.#failures++);
      this.handlers.state("lost", performance.now() + pause);
      this.#timer = setTimeout(() => this.#connect(), pause);
    };
  }
}

export function socketAddress(path: string, page: { protocol: string; host: string }): string {
  return `${page.protocol === "https:" ? "wss" : "ws"}://${page.host}${path}`;
}
