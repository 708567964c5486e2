import type { Panel } from "../panel";
import { t } from "./text";

export default {
  id: "recordings",
  order: 62,
  title: () => t("title"),
  icon: "M3 5h14v10H3ZM10 7.5a2.5 2.5 0 1 0 .01 0ZM3 17h14",
  load: () => import("./Recordings.svelte"),
  fits: (model) => model.commands.has("save"),
} satisfies Panel;
