/** Pending requests: each ends with a reply, a timeout, or the end of the connection. */
import type { Reply } from "./protocol";

interface Waiting { resolve(reply: Reply): void; timer: ReturnType<typeof setTimeout> }

export class Requests {
  #next = Math.floor(Math.random() * 2 ** 31);
  #waiting = new Map<number, Waiting>();

  /** `send` gets the request's number and returns whether it was sent. The promise always resolves; read `ok`. */
  ask(send: (request: number) => boolean, words: { notConnected: string; noReply: string }, patience_ms = 5000): Promise<Reply> {
    const request = this.#next++;
    if (!send(request)) return Promise.resolve({ type: "reply", request, ok: false, text: words.notConnected });
    return new Promise((resolve) => {
      const timer = setTimeout(() => this.answer({ type: "reply", request, ok: false, text: words.noReply }), patience_ms);
      this.#waiting.set(request, { resolve, timer });
    });
  }

  answer(reply: Reply) {
    const waiting = this.#waiting.get(reply.request);
    if (!waiting) return;
    this.#waiting.delete(reply.request);
    clearTimeout(waiting.timer);
    waiting.resolve(reply);
  }

  fail(text: string) {
    for (const request of [...this.#waiting.keys()]) this.answer({ type: "reply", request, ok: false, text });
  }
}
