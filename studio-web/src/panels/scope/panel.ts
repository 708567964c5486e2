import type { Panel } from "../panel";
import { t } from "./text";

export default {
  id: "scope",
  order: 30,
  title: () => t("title"),
  icon: "M2 17V3M2 17h16M4 12l3-6 4 8 3-5 4 3",
  load: () => import("./Scope.svelte"),
} satisfies Panel;
