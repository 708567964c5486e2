/** Calls once for each picture the browser draws, while the page can be seen. */
type Draw = (now_ms: number) => void;

const draws = new Set<Draw>();
let handle = 0;

function frame(now_ms: number): void {
  handle = draws.size ? requestAnimationFrame(frame) : 0;
  for (const draw of draws) draw(now_ms);
}

/** Gives what ends it. */
export function eachFrame(draw: Draw): () => void {
  draws.add(draw);
  handle ||= requestAnimationFrame(frame);
  return () => void draws.delete(draw);
}

/** What cannot be seen is brought up to date so often, for those who do not look at it. */
const UNSEEN_MS = 1000;
const seen = new Map<Element, boolean>();
let observer: IntersectionObserver | undefined;

function watcher(): IntersectionObserver {
  observer ??= new IntersectionObserver(
    (entries) => entries.forEach(({ target, isIntersecting }) => seen.has(target) && seen.set(target, isIntersecting)),
    { rootMargin: "100px" },
  );
  return observer;
}

/** As `eachFrame` while an element is in sight, and now and then while it is not; gives what ends it. */
export function eachFrameOf(node: Element, draw: Draw): () => void {
  seen.set(node, true);
  watcher().observe(node);
  let last = -UNSEEN_MS;
  const end = eachFrame((now_ms) => {
    if (!seen.get(node) && now_ms - last < UNSEEN_MS) return;
    last = now_ms;
    draw(now_ms);
  });
  return () => {
    end();
    watcher().unobserve(node);
    seen.delete(node);
  };
}

const TEXT_MS = 50;

/** A Svelte action: the text of an element, asked for 20 times a second and set only where it has changed. */
export function live(node: HTMLElement, text: () => string) {
  let ask = text;
  let shown = "";
  let last = -TEXT_MS;
  const end = eachFrameOf(node, (now_ms) => {
    if (now_ms - last < TEXT_MS) return;
    last = now_ms;
    const wanted = ask();
    if (wanted !== shown) node.textContent = shown = wanted;
  });
  return {
    update(next: () => string) {
      ask = next;
      last = -TEXT_MS;
    },
    destroy: end,
  };
}
