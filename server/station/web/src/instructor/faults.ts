/** Faults for training: their amounts, in the units of the form and of the message. */

export const faultKinds = ["camera_delay", "camera_loss", "laser_dropouts", "low_battery", "dead_wheel"] as const;
export type FaultKind = (typeof faultKinds)[number];

export interface FaultChoice { kind: FaultKind; amount: number; side: "left" | "right"; lasting: number }

/** The value in the form: ms of delay, otherwise %. */
export const ranges: Record<FaultKind, { min: number; max: number; usual: number; step: number } | null> = {
  camera_delay: { min: 50, max: 500, usual: 200, step: 50 },
  camera_loss: { min: 1, max: 90, usual: 10, step: 1 },
  laser_dropouts: { min: 1, max: 90, usual: 20, step: 1 },
  low_battery: { min: 1, max: 50, usual: 15, step: 1 },
  dead_wheel: null,
};

export function faultCommand({ kind, amount, side, lasting }: FaultChoice): { type: "fault" } & Record<string, unknown> {
  const range = ranges[kind];
  return {
    type: "fault", kind, on: true,
    ...(range ? { amount: Math.min(range.max, Math.max(range.min, amount)) / (kind === "camera_delay" ? 1000 : 100) } : { side }),
    ...(lasting > 0 ? { lasting } : {}),
  };
}
