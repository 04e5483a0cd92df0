/** Numbers as text. */

/** As toFixed(), but what is rounded to zero has no sign: "0°", never "-0°". */
export function fixed(value: number, digits: number): string {
  const text = value.toFixed(digits);
  return Number(text) === 0 ? (0).toFixed(digits) : text;
}

/** A heading in degrees, from -179 to 180. */
export function headingText(yaw: number): string {
  const degrees = Number(fixed((yaw * 180) / Math.PI, 0)) % 360;
  return `${degrees <= -180 ? degrees + 360 : degrees > 180 ? degrees - 360 : degrees}°`;
}
