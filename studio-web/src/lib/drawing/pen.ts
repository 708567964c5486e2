/** What is drawn on a canvas, as a list that another thread can draw: operations with their numbers, and the texts they name. */
export interface Drawing {
  /** CSS pixels. */
  width: number;
  height: number;
  /** Pixels of the screen for each of them. */
  ratio: number;
  numbers: Float32Array<ArrayBuffer>;
  texts: readonly string[];
}

type Context = CanvasRenderingContext2D | OffscreenCanvasRenderingContext2D;
type Draw = (ctx: Context, take: () => number, texts: readonly string[]) => void;

const text: (set: (ctx: Context, value: string) => void) => Draw = (set) => (ctx, take, texts) =>
  set(ctx, texts[take()] as string);

/** What a pen can do; the place in this list is the number of the operation. */
const OPERATIONS = {
  beginPath: (ctx) => ctx.beginPath(),
  moveTo: (ctx, take) => ctx.moveTo(take(), take()),
  lineTo: (ctx, take) => ctx.lineTo(take(), take()),
  rect: (ctx, take) => ctx.rect(take(), take(), take(), take()),
  stroke: (ctx) => ctx.stroke(),
  fill: (ctx) => ctx.fill(),
  clip: (ctx) => ctx.clip(),
  save: (ctx) => ctx.save(),
  restore: (ctx) => ctx.restore(),
  fillRect: (ctx, take) => ctx.fillRect(take(), take(), take(), take()),
  fillText: (ctx, take, texts) => ctx.fillText(texts[take()] as string, take(), take()),
  lineWidth: (ctx, take) => void (ctx.lineWidth = take()),
  alpha: (ctx, take) => void (ctx.globalAlpha = take()),
  dash: (ctx, take) => ctx.setLineDash(Array.from({ length: take() }, take)),
  fillStyle: text((ctx, value) => (ctx.fillStyle = value)),
  strokeStyle: text((ctx, value) => (ctx.strokeStyle = value)),
  font: text((ctx, value) => (ctx.font = value)),
  textAlign: text((ctx, value) => (ctx.textAlign = value as CanvasTextAlign)),
  textBaseline: text((ctx, value) => (ctx.textBaseline = value as CanvasTextBaseline)),
  lineJoin: text((ctx, value) => (ctx.lineJoin = value as CanvasLineJoin)),
} as const satisfies Record<string, Draw>;

const CODES = Object.fromEntries(Object.keys(OPERATIONS).map((name, code) => [name, code])) as Record<
  keyof typeof OPERATIONS,
  number
>;
const DRAWS: readonly Draw[] = Object.values(OPERATIONS);

/** Writes a drawing: the part of a canvas context that is needed for pictures of lines and words. */
export class Pen {
  private numbers: number[] = [];
  private texts: string[] = [];
  private readonly known = new Map<string, number>();

  beginPath = (): void => this.put(CODES.beginPath);
  moveTo = (x: number, y: number): void => this.put(CODES.moveTo, x, y);
  lineTo = (x: number, y: number): void => this.put(CODES.lineTo, x, y);
  rect = (x: number, y: number, width: number, height: number): void => this.put(CODES.rect, x, y, width, height);
  stroke = (): void => this.put(CODES.stroke);
  fill = (): void => this.put(CODES.fill);
  clip = (): void => this.put(CODES.clip);
  save = (): void => this.put(CODES.save);
  restore = (): void => this.put(CODES.restore);
  fillRect = (x: number, y: number, width: number, height: number): void =>
    this.put(CODES.fillRect, x, y, width, height);
  fillText = (words: string, x: number, y: number): void => this.put(CODES.fillText, this.index(words), x, y);
  setLineDash = (dash: readonly number[]): void => this.put(CODES.dash, dash.length, ...dash);
  set lineWidth(width: number) {
    this.put(CODES.lineWidth, width);
  }
  set globalAlpha(alpha: number) {
    this.put(CODES.alpha, alpha);
  }
  set fillStyle(colour: string) {
    this.put(CODES.fillStyle, this.index(colour));
  }
  set strokeStyle(colour: string) {
    this.put(CODES.strokeStyle, this.index(colour));
  }
  set font(font: string) {
    this.put(CODES.font, this.index(font));
  }
  set textAlign(align: CanvasTextAlign) {
    this.put(CODES.textAlign, this.index(align));
  }
  set textBaseline(baseline: CanvasTextBaseline) {
    this.put(CODES.textBaseline, this.index(baseline));
  }
  set lineJoin(join: CanvasLineJoin) {
    this.put(CODES.lineJoin, this.index(join));
  }

  /** What has been drawn since the last one was taken. */
  take(width: number, height: number, ratio: number): Drawing {
    const { numbers, texts } = this;
    [this.numbers, this.texts] = [[], []];
    this.known.clear();
    return { width, height, ratio, numbers: Float32Array.from(numbers), texts };
  }

  private put(...numbers: number[]): void {
    for (const number of numbers) this.numbers.push(number);
  }

  private index(words: string): number {
    let found = this.known.get(words);
    if (found === undefined) this.known.set(words, (found = this.texts.push(words) - 1));
    return found;
  }
}

/** Draws it on a canvas, which gets its size. */
export function drawOn(canvas: HTMLCanvasElement | OffscreenCanvas, ctx: Context, drawing: Drawing): void {
  const { numbers, texts, ratio } = drawing;
  const [width, height] = [Math.round(drawing.width * ratio), Math.round(drawing.height * ratio)];
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
  let at = 0;
  const take = () => numbers[at++] as number;
  while (at < numbers.length) (DRAWS[take()] as Draw)(ctx, take, texts);
}
