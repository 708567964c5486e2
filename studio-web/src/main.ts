import { served } from "./lib/protocol/served";
import { start } from "./start";

start(served);
