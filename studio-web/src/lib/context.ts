import { getContext, setContext } from "svelte";
import type { Layout } from "./state/layout.svelte";
import type { Studio } from "./state/studio.svelte";

const STUDIO = Symbol("studio");
const LAYOUT = Symbol("layout");

export const provide = (studio: Studio, layout: Layout): void => {
  setContext(STUDIO, studio);
  setContext(LAYOUT, layout);
};
export const useStudio = (): Studio => getContext(STUDIO);
export const useLayout = (): Layout => getContext(LAYOUT);
