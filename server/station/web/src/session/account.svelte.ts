/** The logged-in user, log-in and log-out. */
import { strings } from "../strings.en";
import type { Who } from "./protocol";

class Account {
  /** Token of the one-time link that creates the first account; null: this page was not opened by it, or it is used. */
  setUpToken = $state(location.pathname.endsWith("/setup") ? new URLSearchParams(location.search).get("token") : null);
  /** undefined: not requested yet; null: nobody, also while there is no account. */
  who = $state.raw<Who | null | undefined>(this.setUpToken ? null : undefined);

  /** The user after a log-in in another tab; null: still `who`. The user never changes without confirmation. */
  other = $state.raw<Who | null>(null);
  #looks = 0;

  async look(): Promise<void> {
    const look = ++this.#looks, found = await me();
    if (look !== this.#looks) return;
    if (!this.who || !found) this.who = found;
    else this.other = this.who.name === found.name && this.who.role === found.role ? null : found;
  }
  /** Reconnects everything as the user who is logged in now. */
  goOn() {
    this.who = this.other ?? (this.who && { ...this.who });
    this.other = null;
  }

  /** Error text, or null. */
  async logIn(name: string, password: string): Promise<string | null> {
    return this.#post("api/v1/login", { name, password });
  }

  /** Creates the first account. Removes the link's token from the address before the page stores its view there. */
  async setUp(name: string, password: string): Promise<string | null> {
    return this.#post("api/v1/setup", { token: this.setUpToken, name, password }, () => {
      this.setUpToken = null;
      history.replaceState(null, "", "./");
    });
  }

  /** Ends all other sessions of this account. */
  async changePassword(old: string, fresh: string): Promise<string | null> {
    return this.#post("api/v1/password", { old, new: fresh });
  }

  async logOut(): Promise<void> {
    await fetch("api/v1/logout", { method: "POST" }).catch(() => undefined);
    this.who = null;
  }

  async #post(path: string, body: unknown, done = () => {}): Promise<string | null> {
    let answer: Response;
    try {
      answer = await fetch(path, { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(body) });
    } catch {
      return strings.login.unreachable;
    }
    if (answer.status === 429) return strings.login.wait(Number(answer.headers.get("Retry-After")) || 1);
    if (answer.status === 401) return strings.login.wrong;
    if (!answer.ok) return (await reason(answer)) ?? strings.login.failed(answer.status);
    done();
    await this.look();
    return null;
  }
}

async function me(): Promise<Who | null> {
  try {
    const answer = await fetch("api/v1/me");
    return answer.ok ? ((await answer.json()) as Who) : null;
  } catch {
    return null;
  }
}

/** The server's text for a refusal. */
export async function reason(answer: Response): Promise<string | null> {
  try {
    const { error } = (await answer.json()) as { error?: unknown };
    return typeof error === "string" ? error : null;
  } catch {
    return null;
  }
}

export const account = new Account();
