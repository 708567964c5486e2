import type { Panel } from "../panel";
import { t } from "./text";

export default {
  id: "faults",
  order: 50,
  title: () => t("title"),
  icon: "M11 2L4 11h5l-1 7 7-9h-5Z",
  load: () => import("./Faults.svelte"),
  fits: (model) => model.commands.has("fault"),
} satisfies Panel;
