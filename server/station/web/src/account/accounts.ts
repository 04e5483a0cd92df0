/** Account requests of administrators. Each resolves to an error text, or null. */
import { reason } from "../session/account.svelte";
import type { Role } from "../session/protocol";
import { strings } from "../strings.en";

export interface AccountRow { name: string; role: Role }
/** `time`: ISO 8601, UTC. `from`: client address. */
export interface AuditEntry { time: string; who: string; from: string; what: string; outcome: string; detail: string }

const path = "api/v1/accounts";

/** Creates an account, or changes the given fields of one. */
export const putAccount = (account: { name: string; role?: Role; password?: string }) =>
  asked(path, { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(account) });
export const removeAccount = (name: string) => asked(`${path}?name=${encodeURIComponent(name)}`, { method: "DELETE" });

async function asked(url: string, request: RequestInit): Promise<string | null> {
  const answer = await fetch(url, request).catch(() => null);
  if (!answer) return strings.login.unreachable;
  return answer.ok ? null : ((await reason(answer)) ?? strings.login.failed(answer.status));
}

/** null: no reply of the server. */
export async function accountRows(): Promise<AccountRow[] | null> {
  const reply = (await read(path)) as { accounts?: AccountRow[] } | null;
  return Array.isArray(reply?.accounts) ? reply.accounts : null;
}
export async function auditEntries(): Promise<AuditEntry[] | null> {
  const reply = (await read("api/v1/audit")) as { entries?: AuditEntry[] } | null;
  return Array.isArray(reply?.entries) ? reply.entries : null;
}

async function read(url: string): Promise<unknown> {
  const answer = await fetch(url).catch(() => null);
  return answer?.ok ? answer.json() : null;
}
