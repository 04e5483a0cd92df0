/** Faults for training: their amounts, in the units of the form and of the message. */

export const lessonKinds = ["camera_delay", "camera_loss", "laser_dropouts", "low_battery", "dead_wheel"] as const;
export type LessonKind = (typeof lessonKinds)[number];

export interface LessonChoice { kind: LessonKind; amount: number; side: "left" | "right"; lasting: number }

/** The value in the form: ms of delay, otherwise %. */
export const ranges: Record<LessonKind, { least: number; most: number; usual: number; step: number } | null> = {
  camera_delay: { least: 50, most: 500, usual: 200, step: 50 },
  camera_loss: { least: 1, most: 90, usual: 10, step: 1 },
  laser_dropouts: { least: 1, most: 90, usual: 20, step: 1 },
  low_battery: { least: 1, most: 50, usual: 15, step: 1 },
  dead_wheel: null,
};

export function lessonCommand({ kind, amount, side, lasting }: LessonChoice): { type: "lesson" } & Record<string, unknown> {
  const range = ranges[kind];
  return {
    type: "lesson", kind, on: true,
    ...(range ? { amount: Math.min(range.most, Math.max(range.least, amount)) / (kind === "camera_delay" ? 1000 : 100) } : { side }),
    ...(lasting > 0 ? { lasting } : {}),
  };
}
