import { facesOf } from "./faces";
import { colourOf, DARK, lookOf, type Levels } from "./looks";
import { POSE } from "./poses";
import type { Stage } from "./stage";
import { Order, pageOf, placeAlong, type View } from "./view";

/** Values of properties of app.css, `--ink`: `#16191d`. */
export type Palette = ReadonlyMap<string, string>;

/** Both palettes of app.css, in which that of the dark theme is a rule of its own. */
export function palettesOf(css: string): Record<"light" | "dark", Palette> {
  const [first = "", second = ""] = css.split("[data-theme=");
  const colours = (text: string) => [...text.matchAll(/(--[\w-]+): (#[0-9a-f]{6});/g)].map(([, name, value]) => [name, value] as [string, string]); // prettier-ignore
  const light = colours(first);
  return { light: new Map(light), dark: new Map([...light, ...colours(second)]) };
}

/** So much of the first colour in a mixture. */
function mixed(first: string, share: number, second: string): string {
  const channel = (n: number) => {
    const [a, b] = [first, second].map((one) => parseInt(one.slice(1 + 2 * n, 3 + 2 * n), 16)) as [number, number];
    return Math.round(a * share + b * (1 - share))
      .toString(16)
      .padStart(2, "0");
  };
  return `#${channel(0)}${channel(1)}${channel(2)}`;
}

const escaped = (text: string) => text.replace(/[&<>"]/g, (one) => `&#${one.charCodeAt(0)};`);

/** A scene at one moment as the text of an SVG whose longer side has `width` pixels; with a title as a picture of its own, on paper. */
export function pictureOf(
  stage: Stage,
  view: View,
  levels: Levels,
  palette: Palette,
  width: number,
  title: string | null = null,
): string {
  const frame = pageOf(view, stage.extents);
  const pixel = Math.max(frame[2], frame[3]) / width;
  const colour = (property: string) => palette.get(property) ?? "#000000";
  const [paper, line] = [colour("--paper"), mixed(colour("--ink"), 0.55, colour("--paper"))];
  const order = new Order(stage, view);
  order.update();
  const shapes = Array.from(order.drawn, (n) => {
    const solid = stage.solids[n];
    if (solid === undefined || !stage.isThere[n]) return "";
    const look = lookOf(solid, levels);
    const own = colourOf(look, solid);
    const whole = own.startsWith("--") ? colour(own) : own;
    const fill = look === "glass" ? mixed(whole, DARK, colour("--rubber")) : whole;
    const isLine = solid.line !== undefined;
    const isLight = solid.material === "light" || isLine;
    const faces = facesOf(solid, stage.places, n * POSE, view, stage.lines.get(n));
    const lights = [
      [faces.front, fill],
      [faces.side, mixed(fill, 0.84, "#000000")],
      [faces.top, mixed(fill, 0.8, "#ffffff")],
    ] as const;
    const paths = lights
      .filter(([data]) => data)
      .map(([data, one]) => `<path d="${data}" fill="${isLine ? "none" : one}"/>`);
    const place = `translate(${placeAlong(view.right, stage.places, n * POSE).toFixed(2)} ${(-placeAlong(view.up, stage.places, n * POSE)).toFixed(2)})`;
    const thick = look === "interrupted" || isLine ? ` stroke-width="${(2.5 * pixel).toFixed(3)}"` : "";
    const faint = look === "light" ? ' opacity="0.3"' : "";
    const name = n < stage.fixed ? solid.element : (stage.pieces.names[n - stage.fixed] ?? "");
    return `<g transform="${place}"${isLight ? ` stroke="${fill}"` : ""}${thick}${faint}><title>${escaped(name)}</title>${paths.join("")}</g>`; // prettier-ignore
  });
  const [x, y, w, h] = frame.map((one) => one.toFixed(2)) as [string, string, string, string];
  const size = `width="${Math.round(frame[2] / pixel)}" height="${Math.round(frame[3] / pixel)}"`;
  return (
    `<svg xmlns="http://www.w3.org/2000/svg" viewBox="${x} ${y} ${w} ${h}" ${size}>` +
    (title === null
      ? ""
      : `<title>${escaped(title)}</title><rect x="${x}" y="${y}" width="${w}" height="${h}" fill="${paper}"/>`) +
    `<g stroke="${line}" stroke-width="${pixel.toFixed(3)}" stroke-linejoin="round">${shapes.join("")}</g></svg>\n`
  );
}
