import { expect, test } from "vitest";
import { RequestError } from "../protocol/connection";
import { Question } from "./question.svelte";
import type { Ask } from "./watch.svelte";

interface Sent {
  fields: object;
  answer: (value: object) => void;
  fail: (error: Error) => void;
}

function rig(moment: bigint | null = null) {
  const sent: Sent[] = [];
  const ask = (_: string, fields: object) =>
    new Promise((answer, fail) => void sent.push({ fields, answer, fail })) as never;
  return { sent, question: new Question(ask as Ask, () => moment) };
}

test("it is asked about the moment that the page shows, or about that of the event", () => {
  const { sent, question } = rig(5n);
  void question.ask("cup.HELD");
  void question.ask("cup.HELD", 7n);
  expect(sent.map(({ fields }) => fields)).toEqual([
    { question: "cup.HELD", at_ns: "5" },
    { question: "cup.HELD", at_ns: "7" },
  ]);
});

test("an answer to an earlier question, and one that comes after it was closed, are not shown", async () => {
  const { sent, question } = rig();
  const [first, second] = [question.ask("a"), question.ask("b")];
  sent[1]?.answer({ question: "b" });
  await second;
  sent[0]?.answer({ question: "a" });
  await first;
  expect([question.answer?.question, question.isAsking]).toEqual(["b", false]);
  const third = question.ask("c");
  question.close();
  sent[2]?.fail(new RequestError("refusal", "no past"));
  await third;
  expect([question.asked, question.answer, question.problem]).toEqual([null, null, null]);
});

test("more is asked about the moment that was answered", async () => {
  const { sent, question } = rig();
  const first = question.ask("cup.held");
  sent[0]?.answer({ question: "cup.held", at_ns: "9" });
  await first;
  question.askMore({ try_without: true });
  expect(sent[1]?.fields).toEqual({ question: "cup.held", at_ns: "9", try_without: true });
});
