import { start } from "../start";
import { InPage } from "./inpage";

start(new InPage(new URL(".", document.baseURI), "demo"));
