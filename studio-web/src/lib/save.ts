import { errorOf } from "./protocol/connection";
import type { Answer } from "./protocol/types";
import { tokenHeaders } from "./state/greeting";

/** Gives a file to the browser's downloads. */
export function save(blob: Blob, name: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** A file of the studio. Rejects with the words of the studio. */
export async function fetchFile(path: string): Promise<Blob> {
  const response = await fetch(path, { headers: tokenHeaders() });
  if (response.ok) return response.blob();
  const answer = (await response.json().catch(() => null)) as Answer | null;
  throw answer?.error ? errorOf(answer.error) : `${response.status} ${response.statusText}`;
}
