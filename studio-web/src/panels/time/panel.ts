import type { Panel } from "../panel";
import { t } from "./text";

export default {
  id: "time",
  order: 60,
  title: () => t("title"),
  icon: "M10 3a7 7 0 1 0 .01 0ZM10 6v4l3 2",
  load: () => import("./Time.svelte"),
  fits: (model) => model.commands.has("pause"),
} satisfies Panel;
