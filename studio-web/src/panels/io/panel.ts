import type { Panel } from "../panel";
import { t } from "./text";

export default {
  id: "io",
  order: 30,
  title: () => t("title"),
  icon: "M6 6a2.5 2.5 0 1 0 .01 0ZM14 6a2.5 2.5 0 1 0 .01 0ZM6 12v5M14 12v5",
  load: () => import("./Io.svelte"),
} satisfies Panel;
