/** Layers of the plan and the 3D view, each on or off. */
export const layerNames = ["model", "labels", "map", "scan", "virtual", "robots", "paths", "motion", "zones", "events", "depth", "cloud", "recorded", "collision"] as const;
export type LayerName = (typeof layerNames)[number];
export const defaultLayers: LayerName[] = ["model", "map", "scan", "virtual", "robots", "paths", "motion", "zones", "events", "recorded"];
