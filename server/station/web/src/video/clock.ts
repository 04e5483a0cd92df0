/** Offset between the server's clock and the page's, from the recent exchange with the shortest round trip
 * (Cristian's method). */

/** us added to the page's milliseconds to get the server's microseconds; uncertain by half of `roundTripMs`. */
export interface ClockOffset { us: number; roundTripMs: number }

const keep = 20;

export class ServerClock {
  private exchanges: ClockOffset[] = [];

  /** `sentMs` and `now`: the page's clock; `serverUs`: the server's clock in its reply. */
  answer(sentMs: number, serverUs: number, now: number): void {
    const roundTripMs = now - sentMs;
    if (!(roundTripMs >= 0) || !Number.isFinite(serverUs)) return;
    this.exchanges.push({ us: serverUs - (sentMs + roundTripMs / 2) * 1000, roundTripMs });
    if (this.exchanges.length > keep) this.exchanges.shift();
  }
  /** undefined: unknown yet. */
  offset(): ClockOffset | undefined {
    return this.exchanges.reduce<ClockOffset | undefined>(
      (best, each) => (!best || each.roundTripMs < best.roundTripMs ? each : best), undefined);
  }
  /** The server's clock, us. */
  serverUs(now: number): number | undefined {
    const offset = this.offset();
    return offset && now * 1000 + offset.us;
  }
  restart(): void {
    this.exchanges = [];
  }
}
