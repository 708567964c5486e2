import { expect, test } from "vitest";
import { Watches, type Ask } from "./watch.svelte";

/** Answers watches with numbers from 1 on, when it is told to. */
function rig() {
  const asked: string[] = [];
  const answers: (() => void)[] = [];
  let number = 0;
  // The answers of a fake are not typed by name.
  const ask = ((name: string, fields: { points?: string[]; watch?: number }) => {
    asked.push(`${name} ${fields.points?.join() ?? fields.watch}`);
    if (name !== "watch") return Promise.resolve(null);
    const own = ++number;
    return new Promise<unknown>((done) => answers.push(() => done({ watch: own, points: [] })));
  }) as unknown as Ask;
  return { watches: new Watches(ask), asked, answer: async () => (answers.shift()!(), await settled()) };
}

const settled = async () => {
  for (let turn = 0; turn < 5; turn++) await Promise.resolve();
};

test("values reach who watches their point, null for what is not known", async () => {
  const { watches, answer } = rig();
  const [watch] = watches.add(["a.x", "a.y", "a.x"]);
  expect(watch.get("a.x")).toBeUndefined();
  await answer();
  watches.take({
    "1": [
      [0, 5],
      [1, null],
    ],
    "2": [[0, 9]],
  });
  expect([watch.get("a.x"), watch.get("a.y"), watch.get("a.z"), watch.get(null)]).toEqual([
    5,
    null,
    undefined,
    undefined,
  ]);
});

test("values that come together with the answer are not lost", async () => {
  const { watches, answer } = rig();
  const [watch] = watches.add(["a.x", "a.y"]);
  watches.take({
    "1": [
      [0, 5],
      [1, 6],
    ],
  });
  watches.take({ "1": [[0, 7]] });
  await answer();
  expect([watch.get("a.x"), watch.get("a.y")]).toEqual([7, 6]);
});

test("who shows nothing more lets go, also before the answer is there", async () => {
  const { watches, asked, answer } = rig();
  const [, end] = watches.add(["a.x"]);
  await answer();
  end();
  const [, endEarly] = watches.add(["a.y"]);
  endEarly();
  await answer();
  expect(asked).toEqual(["watch a.x", "unwatch 1", "watch a.y", "unwatch 2"]);
});

test("a new connection is asked for all again, and nothing is asked for no points", async () => {
  const { watches, asked, answer } = rig();
  const [watch] = watches.add(["a.x"]);
  watches.add([]);
  await answer();
  watches.renew();
  await answer();
  watches.take({ "2": [[0, 3]] });
  expect(asked).toEqual(["watch a.x", "watch a.x"]);
  expect(watch.get("a.x")).toBe(3);
});
