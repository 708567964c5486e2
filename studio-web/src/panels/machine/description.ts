import { save } from "../../lib/save";
import type { Studio } from "../../lib/state/studio.svelte";
import { t } from "./text";

/** Says where a changed description was written; one that cannot be is downloaded. */
export function keepDescription(
  studio: Studio,
  { file, name, text }: { file: string | null; name: string; text: string },
): void {
  if (file === null) save(new Blob([text], { type: "application/toml" }), name);
  studio.show({ text: file === null ? t("downloaded", { name }) : t("savedIn", { file }), kind: "done" });
}
