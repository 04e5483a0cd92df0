/** The open dialogue: one at a time, above everything. */
export type DialogueName = "keys" | "password" | "accounts";

class Dialogues {
  open = $state<DialogueName | null>(null);
}
export const dialogues = new Dialogues();
