import type { Studio } from "../../lib/state/studio.svelte";
import { draftOf, keepDraft, ownDrafts } from "../../lib/state/drafts";
import { t } from "./text";
import { withRow } from "./rows";

export interface Taught {
  name: string;
  row: string;
}

class Waiting {
  /** Rows by the address of their table, for an editor that is open. */
  rows = $state.raw<readonly (Taught & { address: string })[]>([]);

  add(address: string, taught: Taught): void {
    this.rows = [...this.rows, { address, ...taught }];
  }

  /** Takes out those of a table. */
  take(address: string): readonly Taught[] {
    const found = this.rows.filter((one) => one.address === address);
    if (found.length) this.rows = this.rows.filter((one) => one.address !== address);
    return found;
  }
}

export const waiting = new Waiting();

interface Table {
  controller: string;
  place: string;
  address: string;
}

/** A row gets into the text of a table that is not in an editor; it stays a draft until it is downloaded. */
export async function teachDraft(studio: Studio, table: Table, { name, row }: Taught): Promise<void> {
  const world = studio.model.name;
  if (!(await ownDrafts(world))) throw new Error(t("draftsElsewhere"));
  const { text } = await studio.ask("program_text", { controller: table.controller, place: table.place });
  const [changed] = withRow(draftOf(world, table.address) ?? text, name, row);
  if (!keepDraft(world, table.address, changed === text ? null : changed)) throw new Error(t("draftsFull"));
}
