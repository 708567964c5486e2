import type { Panel } from "../panel";
import { t } from "./text";

export default {
  id: "configuration",
  order: 42,
  title: () => t("title"),
  icon: "M3 5h8M15 5h2M13 3v4M3 10h2M9 10h8M7 8v4M3 15h6M13 15h4M11 13v4",
  load: () => import("./Configuration.svelte"),
} satisfies Panel;
