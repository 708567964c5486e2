import latin from "@fontsource/ibm-plex-mono/files/ibm-plex-mono-latin-400-normal.woff2?url";
import { drawOn } from "./pen";
import type { FromCanvas, ToCanvas } from "./surface";

let canvas: OffscreenCanvas | null = null;
let ctx: OffscreenCanvasRenderingContext2D | null = null;
const tell = (message: FromCanvas) => self.postMessage(message);

/** Fonts of the page are not those of a worker. Until it is there, and where it cannot be read, another one will do. */
const { fonts } = self as unknown as { fonts: FontFaceSet };
const font = new FontFace("IBM Plex Mono", `url(${latin})`);
fonts.add(font);
font.load().then(
  () => tell({ stale: true }),
  () => undefined,
);

self.onmessage = ({ data }: MessageEvent<ToCanvas>) => {
  if ("canvas" in data) {
    canvas = data.canvas;
    ctx = canvas.getContext("2d", { alpha: false });
  } else if (canvas === null || ctx === null) {
    return;
  } else if ("drawing" in data) {
    drawOn(canvas, ctx, data.drawing);
    // Not before the screen has it: a browser that is slow gets fewer pictures, not a queue of them.
    requestAnimationFrame(() => tell({ drawn: true }));
  } else {
    void canvas.convertToBlob({ type: "image/png" }).then((png) => tell({ png }));
  }
};
