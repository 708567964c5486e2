import type { Panel } from "../panel";
import { t } from "./text";

export default {
  id: "campaigns",
  order: 61,
  title: () => t("title"),
  icon: "M3 17V9h3v8ZM8.5 17V5h3v12ZM14 17v-5h3v5Z",
  load: () => import("./Campaigns.svelte"),
  fits: (model) => model.commands.has("save"),
} satisfies Panel;
