import { mount, unmount } from "svelte";
import { start } from "../start";
import { restoreLanguage } from "../text";
import { InPage } from "./inpage";
import { START, unpack, type Linked } from "./links";
import Offer from "./Offer.svelte";

const root = new URL(".", document.baseURI);
const target = document.getElementById("app") as HTMLElement;
target.replaceChildren();
const open = (linked: Linked | null) => start(new InPage(root, "demo", linked));

if (location.hash.startsWith(START)) {
  restoreLanguage();
  const offer = mount(Offer, {
    target,
    props: {
      linked: unpack(location.hash),
      open: (linked: Linked | null) => void unmount(offer).then(() => open(linked)),
    },
  });
} else open(null);

// Somebody opens another link in this tab. The browser loads nothing for it.
addEventListener("hashchange", () => location.hash.startsWith(START) && location.reload());
