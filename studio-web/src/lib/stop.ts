import { errorOf } from "./protocol/connection";
import type { Answer } from "./protocol/types";

/** Stop all where the studio does not accept this page: a stop needs no token. Rejects with the words of the studio. */
export async function stopAllOverHttp(): Promise<void> {
  const response = await fetch("/api/do/stop_all", { method: "POST", body: "{}" });
  const answer = (await response.json()) as Answer;
  if (answer.error) throw errorOf(answer.error);
}
