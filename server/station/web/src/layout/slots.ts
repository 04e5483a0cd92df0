/** Parts of every layout outside the panels. */
import type { Component } from "svelte";
import EmergencyStop from "../panels/EmergencyStop.svelte";
import FirstSteps from "../panels/FirstSteps.svelte";
import Hands from "../panels/Hands.svelte";
import ChatNotices from "../panels/ChatNotices.svelte";
import LookBack from "../panels/LookBack.svelte";
import PenaltyNotices from "../panels/PenaltyNotices.svelte";
import PlayBar from "../panels/PlayBar.svelte";

/** In the top bar, after the session's name and before the user's menu: the emergency stop is the last one. */
export const topBar: Component[] = [EmergencyStop];
/** Above all panels: hints for new users, and the result. */
export const strip: Component[] = [FirstSteps];
/** Below all panels: the seek bar of a recording, or of the live session. */
export const bottomBar: Component[] = [PlayBar, LookBack];
/** Mounted once, wherever they draw: dialogues, and handlers of keys and game pads. */
export const background: Component[] = [Hands, ChatNotices, PenaltyNotices];
