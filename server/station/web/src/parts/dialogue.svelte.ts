/** Which dialogue is open: one at a time, over everything. */
export type DialogueName = "keys" | "password" | "accounts";

class Dialogues {
  open = $state<DialogueName | null>(null);
}
export const dialogues = new Dialogues();
