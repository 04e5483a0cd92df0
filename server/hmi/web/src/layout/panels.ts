/** Every panel by its name in layouts and URLs. A panel fills its slot and draws no title: the layout does. */
import type { Component } from "svelte";
import { strings } from "../strings.en";

export type PanelName = keyof typeof strings.panels;
type Loader = () => Promise<{ default: Component }>;

/** Panels that are not named here are not built in; a layout leaves them out. */
const loaders: Partial<Record<PanelName, Loader>> = {
};

export const panelTitle = (name: PanelName) => strings.panels[name];
export const panelLoader = (name: PanelName): Loader | undefined => loaders[name];
export const isPanel = (name: string): name is PanelName => name in strings.panels;
