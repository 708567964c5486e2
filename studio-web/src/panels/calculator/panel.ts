import type { Panel } from "../panel";
import { t } from "./text";

export default {
  id: "calculator",
  order: 48,
  title: () => t("title"),
  icon: "M3 16h14M3 16l4-9h6l4 9M7 7v9M13 7v9",
  load: () => import("./Calculator.svelte"),
  fits: (model) => model.controllers.some(({ axes }) => axes.length > 0),
} satisfies Panel;
