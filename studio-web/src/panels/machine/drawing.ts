import { isAid } from "../../lib/scene/aids";
import { shapeOf, type Solid } from "../../lib/scene/builder";
import { facesOf } from "../../lib/scene/faces";
import { colourOf, lookOf, type Levels, type Look } from "../../lib/scene/looks";
import { namedOf } from "../../lib/scene/names";
import { POSE } from "../../lib/scene/poses";
import type { Stage } from "../../lib/scene/stage";
import { Order, pageOf, placeAlong, type View } from "../../lib/scene/view";

const SVG = "http://www.w3.org/2000/svg";
const LIGHTS = ["front", "side", "top"] as const;
const ORDER_MS = 120;
/** It is not known whether a part is seen. */
const NEITHER = 2;
/** Places are whole micrometres: the browser puts other numbers on the heap, two for each part that moves. */
const UM_PER_MM = 1000;
/** A turn that is seen. */
const TURN = 1e-6;

/** What elements are drawn with, seen elsewhere [mm in the picture], and a text with it. */
export interface Ghost {
  names: ReadonlySet<string>;
  x: number;
  y: number;
  text: string;
}

/** What is shown of elements besides where they are. */
export interface Marks extends Levels {
  selected: string;
  labels: boolean;
  /** Before the names of those at which something stands, which are always shown. */
  signs: ReadonlyMap<string, string>;
}

/** How an element is named in a picture; null: it is not. */
export function labelOf(name: string, { selected, labels, signs }: Marks): string | null {
  const sign = signs.get(name);
  if (sign !== undefined) return `${sign} ${name}`;
  return labels || name === selected ? name : null;
}

const create = <K extends keyof SVGElementTagNameMap>(name: K, parent: Element, className = "") => {
  const made = document.createElementNS(SVG, name);
  if (className) made.setAttribute("class", className);
  parent.append(made);
  return made;
};

const valueOf = (color: string) => (color.startsWith("--") ? `var(${color})` : color);

/** At least so long; what is new is not known. */
function grown(numbers: Float64Array<ArrayBuffer>, length: number): Float64Array<ArrayBuffer> {
  if (numbers.length >= length) return numbers;
  const longer = new Float64Array(length).fill(NaN);
  longer.set(numbers);
  return longer;
}

/** A scene in one parallel view, as lines and areas of an SVG that are moved, and drawn anew only where they have turned. */
export class Drawing {
  private readonly parts: SVGGElement[] = [];
  /** How each of them looks. */
  private readonly painted: string[] = [];
  private readonly shapes: string[] = [];
  /** Placing of each, without a text for a picture. */
  private readonly moves: SVGTransform[] = [];
  private isSeen = new Uint8Array();
  private turns = new Float64Array();
  /** [um] */
  private spots = new Float64Array();
  /** Of the stage, the workpieces of which have parts. */
  private revision = -1;
  /** Versions of lines as they are drawn, by the numbers of their parts. */
  private readonly versions = new Map<number, number>();
  private readonly order: Order;
  private readonly all: SVGGElement;
  private readonly labels = new Map<string, SVGTextElement>();
  /** The solids of each element with a label. */
  private readonly named: ReadonlyMap<string, readonly number[]>;
  private readonly copies: SVGGElement;
  private readonly frame: readonly number[];
  private ordered_ms = 0;
  private marks: Marks | null = null;
  /** Version of the stage when it was marked. */
  private knowledge = -1;

  constructor(
    private readonly svg: SVGSVGElement,
    private readonly stage: Stage,
    private readonly view: View,
  ) {
    svg.replaceChildren();
    this.frame = pageOf(view, stage.extents);
    svg.setAttribute("viewBox", this.frame.join(" "));
    this.all = create("g", svg);
    this.all.transform.baseVal.appendItem(this.scaled(1 / UM_PER_MM));
    this.order = new Order(stage, view);
    this.renew();
    this.named = namedOf(stage);
    const words = create("g", svg, "labels");
    for (const name of this.named.keys()) {
      const label = create("text", words);
      label.dataset["element"] = name;
      this.labels.set(name, label);
    }
    this.copies = create("g", svg, "copies");
  }

  /** In the place of those before. */
  ghosts(wanted: readonly Ghost[]): void {
    this.copies.replaceChildren();
    for (const { names, x, y, text } of wanted) {
      const moved = create("g", this.copies);
      moved.setAttribute("transform", `translate(${x} ${-y})`);
      const copy = this.all.cloneNode(false) as SVGGElement;
      for (const part of this.all.children) {
        const n = this.parts.indexOf(part as SVGGElement);
        if (n < this.stage.aids && names.has(this.stage.solids[n]?.element ?? "")) copy.append(part.cloneNode(true));
      }
      moved.append(copy);
      const box = copy.getBBox();
      const label = create("text", moved);
      label.textContent = text;
      label.setAttribute("x", String((box.x + box.width / 2) / UM_PER_MM));
      label.setAttribute("y", String(box.y / UM_PER_MM));
    }
  }

  get aspect(): number {
    return (this.frame[2] ?? 1) / (this.frame[3] ?? 1);
  }

  /** Gives the pixels for 1 mm, in a picture of this size on the screen. */
  fit(width: number, height: number): number {
    const [, , wide = 1, tall = 1] = this.frame;
    const scale = Math.min(width / wide, height / tall) || 1;
    this.svg.style.setProperty("--pixel", `${1 / scale}px`);
    return scale;
  }

  draw(now_ms: number): void {
    const { stage } = this;
    if (this.revision !== stage.revision) this.renew();
    if (this.marks !== null && this.knowledge !== stage.knowledge) this.mark(this.marks);
    for (let n = 0; n < this.parts.length; n++) {
      const isThere = stage.isThere[n] as number;
      if (this.isSeen[n] !== isThere) (this.parts[n] as SVGGElement).style.display = isThere ? "" : "none";
      this.isSeen[n] = isThere;
      if (!isThere) continue;
      if (this.hasTurned(n) || this.versions.get(n) !== stage.lines.get(n)?.version)
        this.outline(n, this.parts[n] as SVGGElement);
      const x = Math.round(placeAlong(this.view.right, stage.places, n * POSE) * UM_PER_MM);
      const y = Math.round(placeAlong(this.view.up, stage.places, n * POSE) * -UM_PER_MM);
      if (this.spots[2 * n] === x && this.spots[2 * n + 1] === y) continue;
      this.spots[2 * n] = x;
      this.spots[2 * n + 1] = y;
      (this.moves[n] as SVGTransform).setTranslate(x, y);
    }
    if (now_ms - this.ordered_ms < ORDER_MS) return;
    this.ordered_ms = now_ms;
    this.sort();
  }

  mark(marks: Marks): void {
    this.marks = marks;
    this.knowledge = this.stage.knowledge;
    const { selected, signs } = marks;
    for (let n = 0; n < this.stage.fixed; n++) {
      const solid = this.stage.solids[n] as Solid;
      const look = lookOf(solid, marks, this.stage.isKnown[n] === 1);
      this.paint(n, look, solid.element === selected && !isAid(solid));
    }
    for (const [name, label] of this.labels) {
      const text = labelOf(name, marks);
      label.classList.toggle("selected", name === selected);
      label.classList.toggle("stands", signs.has(name));
      label.textContent = text;
      label.style.display = text === null ? "none" : "";
    }
  }

  /** A part for each solid. Those of other workpieces than before are drawn anew. */
  private renew(): void {
    const { stage, parts } = this;
    const { solids } = stage;
    while (parts.length > solids.length) parts.pop()?.remove();
    this.moves.length = this.painted.length = this.shapes.length = parts.length;
    this.isSeen = new Uint8Array(solids.length).fill(NEITHER);
    this.turns = grown(this.turns, 9 * solids.length);
    this.spots = grown(this.spots, 2 * solids.length);
    for (let n = this.revision < 0 ? 0 : stage.fixed; n < solids.length; n++) {
      const solid = solids[n] as Solid;
      const part = (parts[n] ??= this.part(solid, n));
      part.dataset["element"] = solid.element;
      this.paint(n, solid.material, false);
      if (n >= stage.fixed) (part.lastChild as Element).textContent = stage.pieces.names[n - stage.fixed] ?? "";
      const shape = shapeOf(solid);
      if (this.shapes[n] !== shape) this.turns.fill(NaN, 9 * n, 9 * n + 9);
      this.shapes[n] = shape;
    }
    this.revision = stage.revision;
    this.ordered_ms = -ORDER_MS;
  }

  /** As a state of its element has it. */
  private paint(n: number, look: Look, isSelected: boolean): void {
    const solid = this.stage.solids[n] as Solid;
    const part = this.parts[n] as SVGGElement;
    const color = colourOf(look, solid);
    const name = `solid ${solid.material} ${look === solid.material ? "" : look} ${isSelected ? "selected" : ""} ${color}`;
    if (this.painted[n] === name) return;
    this.painted[n] = name;
    part.setAttribute("class", name);
    part.style.setProperty("--fill", valueOf(color));
  }

  private part({ material }: Solid, n: number): SVGGElement {
    const part = create("g", this.all);
    this.moves[n] = part.transform.baseVal.appendItem(this.svg.createSVGTransform());
    part.transform.baseVal.appendItem(this.scaled(UM_PER_MM));
    this.spots.fill(NaN, 2 * n, 2 * n + 2);
    for (const light of LIGHTS) create("path", part, light);
    if (material === "piece") create("title", part);
    return part;
  }

  private scaled(by: number): SVGTransform {
    const made = this.svg.createSVGTransform();
    made.setScale(by, by);
    return made;
  }

  private hasTurned(n: number): boolean {
    let has = false;
    for (let k = 0; k < 9; k++) {
      const now = this.stage.places[n * POSE + k] as number;
      if (Math.abs(now - (this.turns[n * 9 + k] as number)) < TURN) continue;
      has = true;
      this.turns[n * 9 + k] = now;
    }
    return has;
  }

  private outline(n: number, part: SVGGElement): void {
    const solid = this.stage.solids[n];
    if (solid === undefined) return;
    const trace = this.stage.lines.get(n);
    if (trace !== undefined) this.versions.set(n, trace.version);
    const faces = facesOf(solid, this.stage.places, n * POSE, this.view, trace);
    LIGHTS.forEach((light, k) => part.children[k]?.setAttribute("d", faces[light]));
  }

  private sort(): void {
    this.order.update();
    let next = this.all.firstChild;
    for (let k = 0; k < this.parts.length; k++) {
      const part = this.parts[this.order.drawn[k] as number] as SVGGElement;
      if (part === next) next = next.nextSibling;
      else this.all.insertBefore(part, next);
    }
    for (const [name, solids] of this.named) this.label(name, solids);
  }

  /** Above what is drawn of it. */
  private label(name: string, solids: readonly number[]): void {
    if (this.marks === null || labelOf(name, this.marks) === null) return;
    let [left, right, top] = [Infinity, -Infinity, Infinity];
    for (const n of solids) {
      const x = this.spots[2 * n] as number;
      if (!this.stage.isThere[n]) continue;
      left = Math.min(left, x);
      right = Math.max(right, x);
      top = Math.min(top, this.spots[2 * n + 1] as number);
    }
    const [x, y] = [(left + right) / 2 / UM_PER_MM, top / UM_PER_MM];
    this.labels.get(name)?.setAttribute("transform", `translate(${x.toFixed(1)} ${y.toFixed(1)})`);
  }
}
