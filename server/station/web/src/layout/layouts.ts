/** Arrangements of panels by role, and their representation in the URL: `#role/layout?robot=NAME&layers=a,b`. */
import type { Role } from "../session/protocol";
import type { strings } from "../strings.en";
import type { PanelName } from "./panels";

export type LayoutName = keyof typeof strings.layouts;
/** Width and height fractions are relative to the others'; panels of one cell are tabs, the first one is shown. */
export interface Cell { fraction: number; panels: PanelName[] }
export interface Column { fraction: number; cells: Cell[]; upright?: number }  // its share where columns are rows
export type Layout = Column[];

const cell = (fraction: number, ...panels: PanelName[]): Cell => ({ fraction, panels });
const column = (fraction: number, ...cells: Cell[]): Column => ({ fraction, cells });

const all: Record<LayoutName, Layout> = {
  drive: [column(1.8, cell(1.75, "video"), cell(1, "drive", "joints")), column(1.3, cell(1, "plan", "view3d")), column(0.85, cell(1, "score", "briefing"), cell(1, "events", "chat", "status"))],
  plan: [column(2, cell(1, "plan", "view3d")), column(1, cell(1, "video"), cell(1, "drive", "score", "events", "chat", "status"))],
  direct: [{ ...column(0.8, cell(1, "instructor", "briefing")), upright: 1.4 }, column(2, cell(1, "plan", "view3d")), column(1.1, cell(1, "video"), cell(1.2, "events", "score", "chat", "status"))],
  scene: [column(2.4, cell(1, "view3d")), column(1, cell(1, "video"), cell(1, "plan"), cell(1, "events", "score", "chat", "status"))],
  watch: [column(1.5, cell(1, "video"), cell(1, "score", "briefing")), column(1.5, cell(1, "plan", "view3d"), cell(0.7, "events", "chat", "status"))],
  check: [column(1, cell(1, "status"), cell(1, "events")), column(1.4, cell(1, "plan"), cell(1, "view3d")), column(1, cell(1, "video"), cell(1, "score", "chat"))],
};

const byRole: Record<Role, LayoutName[]> = {
  trainee: ["drive", "plan", "scene"],
  instructor: ["direct", "scene", "drive", "watch", "check"],
  admin: ["direct", "scene", "drive", "watch", "check"],
  observer: ["watch", "scene", "check"],
};

export const layoutsOf = (role: Role): LayoutName[] => byRole[role];
export const layout = (name: LayoutName): Layout => all[name];

export interface Address { layout: LayoutName; robot: string; layers: string[] | null }

/** The layout in a URL's hash, if this role has it; otherwise the role's first layout. */
export function parseAddress(hash: string, role: Role): Address {
  const [path = "", query = ""] = hash.replace(/^#/, "").split("?", 2);
  const asked = path.split("/")[1] ?? "";
  const parameters = new URLSearchParams(query);
  const layers = parameters.get("layers");
  const names = byRole[role];
  return {
    layout: names.find((name) => name === asked) ?? (names[0] as LayoutName),
    robot: parameters.get("robot") ?? "",
    layers: layers === null ? null : layers.split(",").filter(Boolean),
  };
}

export function formatAddress(role: Role, address: Address): string {
  const parameters: string[] = [];
  if (address.robot) parameters.push(`robot=${encodeURIComponent(address.robot)}`);
  if (address.layers) parameters.push(`layers=${address.layers.map(encodeURIComponent).join(",")}`);
  return `#${role}/${address.layout}${parameters.length ? `?${parameters.join("&")}` : ""}`;
}
