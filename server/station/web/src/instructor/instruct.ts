/** Commands of a page: each gets a reply, which is shown. */
import { hints } from "../layout/hints.svelte";
import { notices } from "../session/notices.svelte";
import type { Ask } from "../session/protocol";
import { session } from "../session/session.svelte";

/** True: it was done. */
export async function instruct(command: Ask, done = ""): Promise<boolean> {
  const reply = await session.ask(command);
  if (!reply.ok) notices.show(reply.text, "wrong");
  else if (done || reply.text) notices.show(done || reply.text);
  if (reply.ok && command.action === "spawn") hints.see("instructor");
  return reply.ok;
}
