/** What stands outside the panels, in every layout. */
import type { Component } from "svelte";
import EmergencyStop from "../panels/EmergencyStop.svelte";
import FirstSteps from "../panels/FirstSteps.svelte";
import Hands from "../panels/Hands.svelte";
import Letters from "../panels/Letters.svelte";
import LookBack from "../panels/LookBack.svelte";
import PlayBar from "../panels/PlayBar.svelte";

/** In the top bar, after the session's name and before the user's menu: the emergency stop is the last of them. */
export const topBar: Component[] = [EmergencyStop];
/** Above all panels: what a newcomer can do, and how it ended. */
export const strip: Component[] = [FirstSteps];
/** Below all panels: the seek bar of a recording, or of a live session so far. */
export const bottomBar: Component[] = [PlayBar, LookBack];
/** Mounted once, wherever they draw: dialogues, and what listens to keys and game pads. */
export const background: Component[] = [Hands, Letters];
