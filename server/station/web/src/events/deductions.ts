/** What a deduction cost, for people. */
import type { SessionEvent } from "../session/protocol";
import { strings } from "../strings.en";

const points = (value: number) => String(Math.round(value * 10) / 10);

/** "collision with barrel_1: −5 (no. 3, −15 in all)". `events`: all so far; `named`: the robot is named, too. */
export function deductionText(events: readonly SessionEvent[], deduction: SessionEvent, named = false): string {
  const same = events.filter((each) => each.kind === "points_deducted" && each.object === deduction.object && each.subject === deduction.subject && each.t <= deduction.t);
  const total = same.reduce((sum, each) => sum + each.value, 0);
  const rule = named ? `${deduction.subject}: ${deduction.object}` : deduction.object;
  const whom = causeOf(deduction);
  return strings.score.deducted(whom ? `${rule} (${whom})` : rule, points(deduction.value), same.length, points(total));
}

/** "contact_started rover - barrel_1, 3.20 N s" -> "barrel_1": whom it concerned. */
function causeOf(deduction: SessionEvent): string {
  return / - ([^(,]+?)(?: \(|,|$)/.exec(deduction.text ?? "")?.[1] ?? "";
}
