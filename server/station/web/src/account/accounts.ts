/** What administrators ask of the server about accounts. Each resolves to what went wrong in words, or null. */
import { reason } from "../session/account.svelte";
import type { Role } from "../session/protocol";
import { strings } from "../strings.en";

export interface AccountRow { name: string; role: Role }
/** `time`: ISO 8601, UTC. `from`: the address it came from. */
export interface AuditEntry { time: string; who: string; from: string; what: string; outcome: string; detail: string }

const path = "api/v1/accounts";

/** Makes an account, or changes what is said of one that there is. */
export const putAccount = (account: { name: string; role?: Role; password?: string }) =>
  asked(path, { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(account) });
export const removeAccount = (name: string) => asked(`${path}?name=${encodeURIComponent(name)}`, { method: "DELETE" });

async function asked(url: string, request: RequestInit): Promise<string | null> {
  const answer = await fetch(url, request).catch(() => null);
  if (!answer) return strings.login.unreachable;
  return answer.ok ? null : ((await reason(answer)) ?? strings.login.failed(answer.status));
}

/** null: the server does not say. */
export async function accountRows(): Promise<AccountRow[] | null> {
  const said = (await read(path)) as { accounts?: AccountRow[] } | null;
  return Array.isArray(said?.accounts) ? said.accounts : null;
}
export async function auditEntries(): Promise<AuditEntry[] | null> {
  const said = (await read("api/v1/audit")) as { entries?: AuditEntry[] } | null;
  return Array.isArray(said?.entries) ? said.entries : null;
}

async function read(url: string): Promise<unknown> {
  const answer = await fetch(url).catch(() => null);
  return answer?.ok ? answer.json() : null;
}
