/** Who is logged in, and how one gets in and out. */
import { strings } from "../strings.en";
import type { Who } from "./protocol";

class Account {
  /** undefined: not asked yet; null: nobody. */
  who = $state.raw<Who | null | undefined>(undefined);

  async look(): Promise<void> {
    try {
      const answer = await fetch("api/v1/me");
      this.who = answer.ok ? ((await answer.json()) as Who) : null;
    } catch {
      this.who = null;
    }
  }

  /** What went wrong in words, or null. */
  async logIn(name: string, password: string): Promise<string | null> {
    return this.#post("api/v1/login", { name, password });
  }

  /** The first account, with the one-time token of the link that the server printed. */
  async setUp(token: string, name: string, password: string): Promise<string | null> {
    return this.#post("api/v1/setup", { token, name, password });
  }

  /** All other log-ins of this account end with it. */
  async changePassword(old: string, fresh: string): Promise<string | null> {
    return this.#post("api/v1/password", { old, new: fresh });
  }

  async logOut(): Promise<void> {
    await fetch("api/v1/logout", { method: "POST" }).catch(() => undefined);
    this.who = null;
  }

  async #post(path: string, body: unknown): Promise<string | null> {
    let answer: Response;
    try {
      answer = await fetch(path, { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(body) });
    } catch {
      return strings.login.unreachable;
    }
    if (answer.status === 429) return strings.login.wait(Number(answer.headers.get("Retry-After")) || 1);
    if (answer.status === 401) return strings.login.wrong;
    if (!answer.ok) return (await reason(answer)) ?? strings.login.failed(answer.status);
    await this.look();
    return null;
  }
}

/** The server's own words for why it refused. */
export async function reason(answer: Response): Promise<string | null> {
  try {
    const { error } = (await answer.json()) as { error?: unknown };
    return typeof error === "string" ? error : null;
  } catch {
    return null;
  }
}

export const account = new Account();
