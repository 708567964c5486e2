import type { Panel } from "../panel";
import { t } from "./text";

export default {
  id: "history",
  order: 63,
  title: () => t("title"),
  icon: "M3 17h14M3 3v14M5 13l3-4 3 2 5-6",
  load: () => import("./History.svelte"),
  fits: (model) => model.commands.has("save"),
} satisfies Panel;
