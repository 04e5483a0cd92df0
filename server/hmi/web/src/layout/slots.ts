/** What stands outside the panels, in every layout. */
import type { Component } from "svelte";

/** In the top bar, after the session's name and before the user's menu: the emergency stop is the last of them. */
export const topBar: Component[] = [];
/** Below all panels: the seek bar of a recording. */
export const bottomBar: Component[] = [];
/** Mounted once, wherever they draw: dialogues, and what listens to keys and game pads. */
export const background: Component[] = [];
