import type { Panel } from "../panel";
import { t } from "./text";

export default {
  id: "frames",
  order: 60,
  title: () => t("title"),
  icon: "M2 6h16M2 10h10M2 14h13M14 10l2-2M14 10l2 2",
  load: () => import("./Frames.svelte"),
  fits: (model) => model.lines.length > 0,
} satisfies Panel;
