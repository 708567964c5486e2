import type { Panel } from "../panel";
import { t } from "./text";

export default {
  id: "audit",
  order: 72,
  title: () => t("title"),
  icon: "M4 3h9l3 3v11H4ZM7 8h6M7 11h6M7 14h4",
  load: () => import("./Audit.svelte"),
} satisfies Panel;
