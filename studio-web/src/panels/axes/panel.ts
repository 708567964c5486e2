import type { Panel } from "../panel";
import { t } from "./text";

export default {
  id: "axes",
  order: 20,
  title: () => t("title"),
  icon: "M3 10h14M3 10l3-3M3 10l3 3M17 10l-3-3M17 10l-3 3M10 6v8",
  load: () => import("./Axes.svelte"),
} satisfies Panel;
