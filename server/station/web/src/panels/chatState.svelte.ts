/** Unread messages of others. */
import { notices } from "../session/notices.svelte";
import { session } from "../session/session.svelte";

class ChatState {
  /** Number of panels that show messages now. */
  #open = $state(0);
  #read = $state(0);
  unread = $derived(this.#open ? 0 : session.chat.slice(this.#read).filter((each) => each.from !== session.hello?.who.name).length);

  get shown(): boolean {
    return this.#open > 0;
  }
  /** A panel shows them until the returned function is called. */
  show(): () => void {
    ++this.#open;
    notices.dropMessages();
    return () => {
      --this.#open;
      this.#read = session.chat.length;
    };
  }
}

export const chatState = new ChatState();
