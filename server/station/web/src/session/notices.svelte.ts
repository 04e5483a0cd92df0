/** Short notices that disappear by themselves; read by screen readers. */

export interface Notice { id: number; text: string; kind: "done" | "wrong" | "message" }
const SHOWN_MS = { done: 4000, wrong: 9000, message: 15_000 };

class Notices {
  list = $state.raw<Notice[]>([]);
  #next = 1;

  show(text: string, kind: Notice["kind"] = "done") {
    const notice = { id: this.#next++, text, kind };
    this.list = [...this.list.slice(-3), notice];
    setTimeout(() => this.drop(notice.id), SHOWN_MS[kind]);
  }

  /** The message is displayed elsewhere now. */
  dropMessages() {
    this.list = this.list.filter((each) => each.kind !== "message");
  }
  drop(id: number) {
    this.list = this.list.filter((each) => each.id !== id);
  }
}

export const notices = new Notices();
