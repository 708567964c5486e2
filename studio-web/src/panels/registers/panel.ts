import type { Panel } from "../panel";
import { t } from "./text";

export default {
  id: "registers",
  order: 40,
  title: () => t("title"),
  icon: "M3 4h14M3 8h14M3 12h14M3 16h14M8 4v12",
  load: () => import("./Registers.svelte"),
  fits: (model) => model.controllers.some(({ sheet }) => sheet.points.length > 0),
} satisfies Panel;
