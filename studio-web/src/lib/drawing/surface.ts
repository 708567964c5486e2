import { Pen, type Drawing } from "./pen";

/** What the page tells the worker. */
export type ToCanvas = { canvas: OffscreenCanvas } | { drawing: Drawing } | { save: true };

/** What the worker tells the page: it can take the next drawing; its font has come, so the last one is out of date; a picture. */
export type FromCanvas = { drawn: true } | { stale: true } | { png: Blob };

/** A canvas that is drawn by a worker, so that the page stays free for keys. */
export class Surface {
  readonly pen = new Pen();
  private readonly worker = new Worker(new URL("./canvas.worker.ts", import.meta.url), { type: "module" });
  private readonly waiting: ((png: Blob) => void)[] = [];
  private underway = 0;

  /** `stale` is called when what has been drawn should be drawn again. A canvas can be given away only once. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    stale: () => void,
  ) {
    const offscreen = canvas.transferControlToOffscreen();
    this.tell({ canvas: offscreen }, [offscreen]);
    this.worker.onmessage = ({ data }: MessageEvent<FromCanvas>) => {
      if ("drawn" in data) this.underway--;
      else if ("stale" in data) stale();
      else this.waiting.shift()?.(data.png);
    };
  }

  /** Whether another drawing is of use: one may wait while one is put on the screen, more would only be late. */
  get isFree(): boolean {
    return this.underway < 2;
  }

  /** Shows what the pen has drawn. [CSS pixels] */
  show(width: number, height: number): void {
    const drawing = this.pen.take(width, height, window.devicePixelRatio || 1);
    this.underway++;
    this.tell({ drawing }, [drawing.numbers.buffer]);
  }

  png(): Promise<Blob> {
    this.tell({ save: true });
    return new Promise((resolve) => void this.waiting.push(resolve));
  }

  end(): void {
    this.worker.terminate();
  }

  get size(): [width: number, height: number] {
    return [this.canvas.clientWidth, this.canvas.clientHeight];
  }

  private tell(message: ToCanvas, given: Transferable[] = []): void {
    this.worker.postMessage(message, given);
  }
}
