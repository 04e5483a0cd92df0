/** Since when a trainee only remembers a thing, as text: "seen 12 s ago"; empty: it is sensed now. */
import { ageText } from "../parts/age";
import { strings } from "../strings.en";
import { session } from "./session.svelte";

export function ageOf(name: string): string {
  const remembered = session.rememberedFor(name);
  return remembered === null ? "" : strings.known.ago(ageText(remembered));
}
