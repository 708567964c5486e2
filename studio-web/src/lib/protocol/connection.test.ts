import { beforeEach, expect, test } from "vitest";
import { Connection, RequestError, type ConnectionState, type Hello } from "./connection";
import type { LinkEvents } from "./backend";
import type { Pushed } from "./types";

/** The other end: what was sent to it, and what it sends. */
class Server {
  links: LinkEvents[] = [];
  sent: Record<string, unknown>[] = [];

  get link(): LinkEvents {
    return this.links.at(-1)!;
  }

  open = (_path: string, events: LinkEvents) => {
    this.links.push(events);
    return { send: (text: string) => void this.sent.push(JSON.parse(text)), close: () => events.closed(1000) };
  };

  last(name: string): Record<string, unknown> {
    return this.sent.filter((request) => request.do === name).at(-1)!;
  }

  greet(): void {
    this.link.messages([
      { id: this.last("hello").id, ok: {} },
      { seq: 0, hello: { viewer: 1 } },
    ]);
  }
}

/** Timers that go off when they are told to. */
class Alarm {
  waiting = new Map<number, { call: () => void; ms: number }>();
  private next = 1;

  set = (call: () => void, ms: number) => {
    this.waiting.set(this.next, { call, ms });
    return this.next++;
  };
  clear = (timer: number) => void this.waiting.delete(timer);

  /** The first that waits for so long. */
  goOff(ms: number): void {
    const [timer, { call }] = [...this.waiting].find(([, one]) => one.ms === ms)!;
    this.waiting.delete(timer);
    call();
  }
}

let server: Server;
let alarm: Alarm;
let hellos: Hello[];
/** By hello, whether it was the first of its connection. */
let isNew: boolean[];
let pushed: Pushed[];
let states: ConnectionState[];
let connection: Connection;

beforeEach(() => {
  server = new Server();
  alarm = new Alarm();
  [hellos, isNew, pushed, states] = [[], [], [], []];
  const events = {
    hello: (hello: Hello, isNewConnection: boolean) => {
      hellos.push(hello);
      isNew.push(isNewConnection);
    },
    pushed: (messages: readonly Pushed[]) => void pushed.push(...messages),
    state: (state: ConnectionState) => void states.push(state),
  };
  connection = new Connection(() => ({ lang: "en" }), events, server.open, alarm);
  connection.open();
  server.link.opened();
});

test("the first request is hello, and the whole state opens the connection", () => {
  expect(server.sent).toEqual([{ do: "hello", version: 2, lang: "en", id: 1 }]);
  server.greet();
  expect(hellos).toHaveLength(1);
  expect(states).toEqual(["open"]);
});

test("answers find their requests, in whatever order they come", async () => {
  server.greet();
  const first = connection.request("time", {});
  const second = connection.request("faults", {});
  const [one, other] = [server.last("time").id, server.last("faults").id];
  server.link.messages([
    { id: other, ok: [] },
    { id: one, ok: "now" },
  ]);
  expect(await first).toBe("now");
  expect(await second).toEqual([]);
});

test("an error has its code and the words of the server", async () => {
  server.greet();
  const asked = connection.request("step", {});
  server.link.messages([{ id: server.last("step").id, error: { code: "refusal", message: "not now" } }]);
  await expect(asked).rejects.toEqual(new RequestError("refusal", "not now"));
  await expect(asked).rejects.toMatchObject({ code: "refusal" });
});

test("an answer that does not come is a timeout, and one that comes later is nobody's", async () => {
  server.greet();
  const asked = connection.request("time", {}, 777);
  alarm.goOff(777);
  await expect(asked).rejects.toMatchObject({ code: "timeout" });
  server.link.messages([{ id: server.last("time").id, ok: "late" }]);
});

test("after a gap nothing is believed until the whole state has come again", () => {
  server.greet();
  server.link.messages([{ seq: 1, viewers: 1 }]);
  server.link.messages([
    { seq: 3, viewers: 3 },
    { seq: 4, viewers: 4 },
  ]);
  expect(pushed).toEqual([{ seq: 1, viewers: 1 }]);
  expect(server.sent.filter((request) => request.do === "resync")).toHaveLength(1);
  server.link.messages([
    { id: server.last("resync").id, ok: null },
    { seq: 0, hello: { viewer: 1 } },
    { seq: 1, viewers: 2 },
  ]);
  expect(hellos).toHaveLength(2);
  expect(pushed.at(-1)).toEqual({ seq: 1, viewers: 2 });
});

test("the whole state can be asked for, once at a time, and tells whether the connection is new", () => {
  connection.resync();
  expect(server.sent.filter((request) => request.do === "resync")).toHaveLength(0);
  server.greet();
  connection.resync();
  connection.resync();
  expect(server.sent.filter((request) => request.do === "resync")).toHaveLength(1);
  server.link.messages([{ seq: 1, viewers: 7 }]);
  server.link.messages([
    { seq: 2, viewers: 8 },
    { id: server.last("resync").id, ok: null },
    { seq: 0, hello: { viewer: 1 } },
    { seq: 1, viewers: 2 },
  ]);
  expect(pushed).toEqual([{ seq: 1, viewers: 2 }]);
  server.link.closed(1006);
  alarm.goOff(100);
  server.link.opened();
  server.greet();
  expect(isNew).toEqual([true, false, true]);
});

test("what was pushed before the whole state in the same batch is part of it", () => {
  server.greet();
  server.link.messages([
    { seq: 1, viewers: 9 },
    { seq: 0, hello: { viewer: 1 } },
    { seq: 1, viewers: 2 },
  ]);
  expect(pushed).toEqual([{ seq: 1, viewers: 2 }]);
});

test("a lost connection fails what waits, and is tried again at growing distances", async () => {
  server.greet();
  const asked = connection.request("time", {});
  server.link.closed(1006);
  await expect(asked).rejects.toMatchObject({ code: "closed" });
  await expect(connection.request("time", {})).rejects.toMatchObject({ code: "closed" });
  expect(states).toEqual(["open", "connecting"]);
  for (const ms of [100, 250, 500, 1000, 2000, 4000, 4000]) {
    alarm.goOff(ms);
    server.link.closed(1006);
  }
  alarm.goOff(4000);
  server.link.opened();
  server.greet();
  expect(states.at(-1)).toBe("open");
  server.link.closed(1006);
  alarm.goOff(100);
});

test("a connection over which nothing comes is silent, and given up in the end", () => {
  server.greet();
  alarm.goOff(2500);
  expect(states.at(-1)).toBe("silent");
  server.link.messages([{ seq: 1, viewers: 1 }]);
  expect(states.at(-1)).toBe("open");
  alarm.goOff(2500);
  alarm.goOff(5500);
  expect(states.at(-1)).toBe("connecting");
});

test("a page without the right token is told why, and knocks no more until it has another one", async () => {
  server.link.messages([{ id: 1, error: { code: "refusal", message: "wrong token" } }]);
  await Promise.resolve();
  await Promise.resolve();
  expect(states).toEqual(["refused"]);
  server.link.closed(4401);
  expect(states).toEqual(["refused"]);
  expect(server.links).toHaveLength(1);
  expect([...alarm.waiting.values()]).toEqual([]);
  connection.renew();
  expect(states).toEqual(["refused", "connecting"]);
  server.link.opened();
  server.greet();
  expect(states.at(-1)).toBe("open");
});

test("a page that is there greets again over a new connection", () => {
  server.greet();
  connection.renew();
  alarm.goOff(100);
  server.link.opened();
  server.greet();
  expect(server.links).toHaveLength(2);
  expect(states).toEqual(["open", "connecting", "open"]);
});
