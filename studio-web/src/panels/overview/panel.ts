import type { Panel } from "../panel";
import { t } from "./text";

export default {
  id: "overview",
  order: 10,
  title: () => t("title"),
  icon: "M3 3h6v6H3ZM11 3h6v6h-6ZM3 11h6v6H3ZM11 11h6v6h-6Z",
  load: () => import("./Overview.svelte"),
} satisfies Panel;
