/** Short words to the user that go away by themselves; read out by screen readers. */

export interface Notice { id: number; text: string; kind: "done" | "wrong" }
const SHOWN_MS = { done: 4000, wrong: 9000 };

class Notices {
  list = $state.raw<Notice[]>([]);
  #next = 1;

  say(text: string, kind: Notice["kind"] = "done") {
    const notice = { id: this.#next++, text, kind };
    this.list = [...this.list.slice(-3), notice];
    setTimeout(() => this.drop(notice.id), SHOWN_MS[kind]);
  }

  drop(id: number) {
    this.list = this.list.filter((each) => each.id !== id);
  }
}

export const notices = new Notices();
