// What the driven robot measures of its surroundings and of itself.
import type { HazardValue } from "../session/protocol";

export interface Reading { name: "radiation" | "gas" | "dose" | "gasDose" | "battery" | "radio"; text: string }

const three = (value: number) => String(value >= 100 ? Math.round(value) : Number(value.toPrecision(3)));
const nameOf = (value: HazardValue): Reading["name"] =>
  value.kind === "gas" ? (value.unit === "ppm" ? "gas" : "gasDose") : value.unit === "uSv/h" ? "radiation" : "dose";

/** `values`: of MR_STATUS; a name without a value is left out. */
export function readingsOf(hazard: HazardValue[], values: Record<string, number>): Reading[] {
  const list: Reading[] = hazard.map((value) => ({ name: nameOf(value), text: `${three(value.value)} ${value.unit.replace("u", "µ")}` }));
  if (values.battery_left !== undefined) list.push({ name: "battery", text: `${Math.round(values.battery_left * 100)} %` });
  if (values.radio_dbm !== undefined) list.push({ name: "radio", text: `${Math.round(values.radio_dbm)} dBm` });
  return list;
}
