/** Every panel by its name in layouts and URLs. A panel fills its slot and draws no title: the layout does. */
import type { Component } from "svelte";
import { strings } from "../strings.en";

export type PanelName = keyof typeof strings.panels;
type Loader = () => Promise<{ default: Component }>;

/** Panels that are not named here are not built in; a layout leaves them out. */
const loaders: Partial<Record<PanelName, Loader>> = {
  video: () => import("../panels/VideoPanel.svelte"),
  drive: () => import("../panels/DrivePanel.svelte"),
  joints: () => import("../panels/JointsPanel.svelte"),
  score: () => import("../panels/ScorePanel.svelte"),
  events: () => import("../panels/EventsPanel.svelte"),
  status: () => import("../panels/StatusPanel.svelte"),
  chat: () => import("../panels/ChatPanel.svelte"),
  briefing: () => import("../panels/BriefingPanel.svelte"),
  instructor: () => import("../panels/InstructorPanel.svelte"),
  plan: () => import("../plan/PlanPanel.svelte"),
  view3d: () => import("../view3d/View3dPanel.svelte"),
};

export const panelTitle = (name: PanelName) => strings.panels[name];
export const panelLoader = (name: PanelName): Loader | undefined => loaders[name];
export const isPanel = (name: string): name is PanelName => name in strings.panels;
/** Nothing in it can be pressed: what scrolls must be reached by keys all the same. */
export const isRead = (name: PanelName) => ["score", "status", "briefing"].includes(name);
