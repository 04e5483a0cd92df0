/** Every panel by its name in layouts and URLs. A panel fills its slot; the layout draws its title. */
import type { Component } from "svelte";
import { strings } from "../strings.en";

export type PanelName = keyof typeof strings.panels;
type Loader = () => Promise<{ default: Component }>;

/** Panels that are not listed here are not built in, and layouts leave them out. */
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
/** Panels without controls: their scrollable content must still be reachable by keyboard. */
export const isRead = (name: PanelName) => ["score", "status", "briefing"].includes(name);
