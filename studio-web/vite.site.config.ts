import { mergeConfig, type UserConfig } from "vite";
import page from "./vite.config.ts";

/** The page with the studio inside it, for any web server: `make site`. */
export default mergeConfig(page as UserConfig, {
  root: "src/site",
  publicDir: "../../public",
  build: { outDir: "../../../build/site/try" },
});
