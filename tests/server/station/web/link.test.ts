import { LONGEST_PAUSE_MS, pauseAfter, socketAddress } from "../../../../server/station/web/src/session/link";
import { parseMessage } from "../../../../server/station/web/src/session/protocol";
import { Requests } from "../../../../server/station/web/src/session/requests";
import { seenAt } from "../../../../server/station/web/src/session/seen";

test("pauses between tries grow, and no longer than they may", () => {
  const pauses = Array.from({ length: 40 }, (_, i) => pauseAfter(i));
  expect(pauses.every((each, i) => i === 0 || each >= (pauses[i - 1] as number))).toBe(true);
  expect(pauses.at(-1)).toBe(LONGEST_PAUSE_MS);
});

test("a page that came encrypted speaks encrypted", () => {
  expect(socketAddress("/ws/state", { protocol: "https:", host: "a:1" })).toBe("wss://a:1/ws/state");
  expect(socketAddress("/ws/state", { protocol: "http:", host: "a" })).toBe("ws://a/ws/state");
});

test("what a newer server says more is passed over; what is not as agreed is refused", () => {
  expect(parseMessage('{"type":"weather"}')).toBeNull();
  expect(parseMessage('{"type":"model","version":3}')).toEqual({ type: "model", version: 3 });
  for (const bad of ["", "[]", "null", "3", '{"type":"events"}', '{"type":"events","list":{}}', '{"type":"hello"}', '{"type":"constructor"}'])
    expect(() => { if (parseMessage(bad) === null) throw new Error("passed over"); }).toThrow();
});

test("the list of several robots is taken", () => {
  expect(parseMessage('{"type":"robots","list":[]}')).toEqual({ type: "robots", list: [] });
});

test("a question ends in its own answer, in silence, or with the connection", async () => {
  const requests = new Requests(), words = { notConnected: "not connected", noReply: "no reply" }, sent: number[] = [];
  const ask = (patience?: number) => requests.ask((request) => { sent.push(request); return true; }, words, patience);
  const first = ask(), second = ask(), third = ask(1);
  requests.answer({ type: "reply", request: sent[1] as number, ok: true, text: "second" });
  requests.answer({ type: "reply", request: 1e9, ok: true, text: "nobody's" });
  expect((await second).text).toBe("second");
  expect(await third).toMatchObject({ ok: false, text: "no reply" });
  requests.fail("lost");
  expect(await first).toMatchObject({ ok: false, text: "lost" });
  expect(await requests.ask(() => false, words)).toMatchObject({ ok: false, text: "not connected" });
});

test("what must not come late says which clock it saw, notes of people too", () => {
  for (const type of ["agent", "script", "fault", "start", "end", "report", "chat", "mark", "control", "estop_release"] as const) {
    expect(seenAt({ type }, { clock: 12.5 })).toEqual({ seen: 12.5 });
    expect(seenAt({ type }, null)).toEqual({});
  }
  expect(seenAt({ type: "save" }, { clock: 12.5 })).toEqual({});
});
