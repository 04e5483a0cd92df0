/** The current view, stored in the URL so that it can be sent to others. */
import type { Role } from "../session/protocol";
import { drawsBySoftware } from "../parts/graphics";
import { selection } from "../session/selection.svelte";
import { defaultLayers, layerNames, type LayerName } from "./layers";
import { formatAddress, parseAddress, type LayoutName } from "./layouts";

/** Recorded surfaces take three times as long to draw as the model where there is no graphics card: there only on request. */
const usualLayers = () => (drawsBySoftware() ? defaultLayers.filter((name) => name !== "recorded") : defaultLayers);

class View {
  layout = $state<LayoutName>("watch");
  /** Named by the URL, or selected by the user. */
  asked = false;
  layers = $state.raw<ReadonlySet<LayerName>>(new Set(defaultLayers));
  /** The layout in the address; the browser's Back returns to it after another one was selected. */
  #written: LayoutName | null = null;

  /** Without an entry in the browser's history. */
  open(layout: LayoutName) {
    this.layout = this.#written = layout;
  }

  read(role: Role) {
    const address = parseAddress(location.hash, role);
    this.layout = this.#written = address.layout;
    this.asked = location.hash.includes("/");
    if (address.robot) selection.robot = address.robot;
    this.layers = new Set(address.layers ? layerNames.filter((name) => address.layers?.includes(name)) : usualLayers());
  }

  write(role: Role) {
    const names = usualLayers(), usual = this.layers.size === names.length && names.every((name) => this.layers.has(name));
    const hash = formatAddress(role, { layout: this.layout, robot: selection.robot, layers: usual ? null : [...this.layers] });
    if (hash === location.hash) return;
    const another = this.#written !== this.layout;
    this.#written = this.layout;
    if (another) history.pushState(null, "", hash);
    else history.replaceState(null, "", hash);
  }

  switchLayer(name: LayerName, on: boolean) {
    const layers = new Set(this.layers);
    if (on) layers.add(name);
    else layers.delete(name);
    this.layers = layers;
  }
}

export const view = new View();
