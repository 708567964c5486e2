import type { Panel } from "../panel";
import { t } from "./text";

export default {
  id: "gateways",
  order: 64,
  title: () => t("title"),
  icon: "M10 4v5M10 9L4 14M10 9l6 5M8 2h4v3H8ZM2 14h4v3H2ZM14 14h4v3h-4Z",
  load: () => import("./Gateways.svelte"),
  fits: (model) => model.commands.has("save"),
} satisfies Panel;
