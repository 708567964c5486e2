import type { Panel } from "../panel";
import { t } from "./text";

export default {
  id: "program",
  order: 45,
  title: () => t("title"),
  icon: "M4 3h9l3 3v11H4zM7 9h6M7 12h6M7 15h3",
  load: () => import("./Program.svelte"),
  fits: (model) => model.controllers.some(({ isReal }) => !isReal),
} satisfies Panel;
