/** Converts MR_STATUS to latency stages and counts. */

export interface Stage { name: string; p50?: number; p99?: number }

const percentile = /^(.*_(us|ms))_p(50|99)$/;

/** Milliseconds; stages that were never measured (NaN) are left out. */
export function stagesOf(values: Record<string, number | null>): Stage[] {
  const stages = new Map<string, Stage>();
  for (const [key, value] of Object.entries(values)) {
    const [, name, unit, which] = percentile.exec(key) ?? [];
    if (!name || value === null || !Number.isFinite(value)) continue;
    const stage = stages.get(name) ?? { name };
    stage[which === "50" ? "p50" : "p99"] = unit === "us" ? value / 1000 : value;
    stages.set(name, stage);
  }
  return [...stages.values()];
}

export function countsOf(values: Record<string, number | null>): [string, number][] {
  return Object.entries(values).filter((entry): entry is [string, number] => !percentile.test(entry[0]) && entry[1] !== null && Number.isFinite(entry[1]));
}
