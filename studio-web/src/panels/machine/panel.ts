import type { Panel } from "../panel";
import { t } from "./text";

export default {
  id: "machine",
  order: 15,
  title: () => t("title"),
  icon: "M2 15h16M4 15v-3h5v3M6.5 12V4M4 7h5M13 15V6M11 6h4",
  load: () => import("./Machine.svelte"),
  fits: (model) => model.mechanics.length > 0 || model.elements.length > 0,
} satisfies Panel;
