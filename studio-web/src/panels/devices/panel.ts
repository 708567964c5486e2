import type { Panel } from "../panel";
import { t } from "./text";

export default {
  id: "devices",
  order: 70,
  title: () => t("title"),
  icon: "M7 3v4M13 3v4M5 7h10v3a5 5 0 0 1-10 0ZM10 15v3",
  load: () => import("./Devices.svelte"),
} satisfies Panel;
