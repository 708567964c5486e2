// View, cursor and mark; keys and mouse.

const $ = (id) => document.getElementById(id);
const plot = $("plot"), scale = $("scale-ends"), ruler = $("ruler"), overview = $("overview"), channelsElement = $("channels");
const view = { from: 0, to: SPAN, scaled: false };
let cursor = 0, mark = null, hover = null, chosen = 0, dirty = false, overviewImage = null, channelsKey = "", layout = 0;
const LEAST_VIEW = 200;

const controllers = DATA.controllers.map((name) => ({ name, channels: null, summary: null, open: DATA.controllers.length <= 8 }));
controllers[0] && (controllers[0].open = true);
let channels = [], wanted = [];

// Channels with all the wanted words; without any, those of the controllers that are not folded.
function channelsShown(controller) {
  if (!wanted.length) return controller.open ? controller.channels ??= channelsOf(controller.name) : [];
  return (controller.channels ??= channelsOf(controller.name)).filter((channel) => {
    const text = `${controller.name} ${channel.name}`.toLowerCase();
    return wanted.every((word) => text.includes(word));
  });
}

function layOut() {
  layout += 1;
  channels = [];
  for (const controller of controllers) {
    if (controllers.length > 1 && !wanted.length) channels.push({ kind: "group", name: controller.name, group: controller, height: HEIGHTS.group });
    channels.push(...channelsShown(controller));
  }
  let y = 0;
  channelsElement.replaceChildren(...channels.map((channel, i) => {
    channel.y = y;
    y += channel.height;
    const element = document.createElement("div");
    element.className = `channel ${channel.kind}${channel.first ? " first" : ""}`;
    element.style.height = `${channel.height}px`;
    element.style.setProperty("--color", `var(${channel.color ?? "--dim"})`);
    element.setAttribute("role", "option");
    if (channel.group) element.setAttribute("aria-expanded", channel.group.open);
    const name = document.createElement("span"), value = document.createElement("span");
    name.className = "name";
    name.textContent = name.title = wanted.length && controllers.length > 1 ? `${channel.controller}.${channel.name}` : channel.name;
    value.className = "value";
    element.append(name, value);
    element.addEventListener("click", () => { choose(i); if (channel.group) fold(channel.group); });
    Object.assign(channel, { element, value });
    return element;
  }));
  chosen = Math.min(chosen, channels.length - 1);
  choose(chosen);
}

function fold(controller, all = false) {
  const open = !controller.open;
  for (const one of all ? controllers : [controller]) one.open = open;
  layOut();
  choose(channels.findIndex((channel) => channel.group === controller));
}

function want(text) {
  wanted = text.toLowerCase().split(/\s+/).filter(Boolean);
  layOut();
  saveInAddress();
}

function choose(i) {
  channels[chosen]?.element.removeAttribute("aria-selected");
  chosen = Math.max(0, Math.min(i, channels.length - 1));
  channels[chosen]?.element.setAttribute("aria-selected", "true");
  channels[chosen]?.element.scrollIntoView({ block: "nearest" });
  redraw();
}

// ---------------------------------------------------------------------- view

function show(from, to) {
  let size = Math.max(Math.min(to - from, SPAN * 1.04), Math.min(LEAST_VIEW, SPAN));
  const middle = (from + to) / 2, slack = size * 0.02;
  from = Math.max(-slack, Math.min(middle - size / 2, SPAN + slack - size));
  Object.assign(view, { from, to: from + size });
  redraw();
}

function zoom(factor, at) {
  show(at - (at - view.from) * factor, at + (view.to - at) * factor);
}

function pan(by) { show(view.from + by, view.to + by); }
function fit() { show(-SPAN * 0.02, SPAN * 1.02); }

function moveCursor(t, follow = true) {
  cursor = Math.max(0, Math.min(Math.round(t), SPAN));
  hover = null;
  const size = view.to - view.from;
  if (follow && (cursor < view.from || cursor > view.to)) show(cursor - size / 2, cursor + size / 2);
  saveInAddress();
  redraw();
}

function zoomToMark() {
  if (mark === null || mark === cursor) return;
  const [from, to] = [Math.min(mark, cursor), Math.max(mark, cursor)], slack = (to - from) * 0.05;
  show(from - slack, to + slack);
}

// ---------------------------------------------------------------------- drawing

const styles = getComputedStyle(document.documentElement);
let palette = new Map();
const color = (name) => palette.get(name) ?? (palette.set(name, styles.getPropertyValue(name).trim()), palette.get(name));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { palette = new Map(); overviewImage = null; channelsKey = ""; scenePainted = ""; redraw(); });

function redraw() {
  if (dirty) return;
  dirty = true;
  requestAnimationFrame(() => { dirty = false; paint(); });
}

function prepare(canvas) {
  const ratio = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    if (canvas === overview) overviewImage = null;
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return [context, width, height];
}

// Channels are drawn anew when something about them has changed; for cursors alone their picture is good enough.
const channelsImage = document.createElement("canvas");

function paint() {
  const [c, width, height] = prepare(plot), scroll = channelsElement.scrollTop;
  const key = [view.from, view.to, view.scaled, scroll, chosen, layout, plot.width, plot.height].join();
  const pen = new Pen(c, view, width, color);
  if (key !== channelsKey) {
    paintLanes(pen, scroll, width, height);
    channelsImage.width = plot.width;
    channelsImage.height = plot.height;
    channelsImage.getContext("2d").drawImage(plot, 0, 0);
    channelsKey = key;
  } else c.drawImage(channelsImage, 0, 0, width, height);
  for (const [t, name] of [[mark, "--mark"], [cursor, "--cursor"]]) {
    if (t === null || t < view.from || t > view.to) continue;
    c.fillStyle = color(name);
    c.fillRect(Math.round(pen.x(t)), 0, 1, height);
  }
  if (hover !== null) {
    c.fillStyle = color("--dim");
    c.globalAlpha = 0.6;
    c.fillRect(Math.round(pen.x(hover)), 0, 1, height);
    c.globalAlpha = 1;
  }
  paintScale(scroll);
  paintRuler();
  paintOverview();
  paintScene();
  tell();
}

function paintScale(scroll) {
  const [c, , height] = prepare(scale);
  for (const channel of channels) {
    const y = channel.y - scroll;
    if (channel.bounds && y + channel.height > 0 && y < height) drawBounds(c, channel, y, color);
  }
}

function paintLanes(pen, scroll, width, height) {
  const c = pen.context;
  drawGrid(pen, view, height);
  // Outside the run nothing is known.
  c.fillStyle = color("--panel");
  c.fillRect(0, 0, Math.max(pen.x(0), 0), height);
  c.fillRect(pen.x(SPAN), 0, Math.max(width - pen.x(SPAN), 0), height);
  channels.forEach((channel, i) => {
    const y = channel.y - scroll;
    if (y + channel.height < 0 || y > height) return;
    if (channel.kind === "group") {
      c.fillStyle = color("--panel");
      c.fillRect(0, y, width, channel.height);
      if (!channel.group.open) drawSummary(pen, channel.group.summary ??= summaryOf(channel.name), y + 5, y + channel.height - 3);
    } else {
      if (i === chosen) {
        c.globalAlpha = 0.5;
        c.fillStyle = color("--chosen");
        c.fillRect(0, y, width, channel.height);
        c.globalAlpha = 1;
      }
      draw(pen, channel, y);
    }
    c.fillStyle = color(channels[i + 1]?.first ? "--rule-strong" : "--rule");
    c.fillRect(0, y + channel.height - 1, width, 1);
  });
}

function paintRuler() {
  const [c, width, height] = prepare(ruler);
  const pen = new Pen(c, view, width, color);
  const origin = drawRuler(pen, view, height);
  $("origin").textContent = origin ? moment(origin - DATA.begin) : "";
  for (const [t, name, text] of [[mark, "--mark", "M"], [cursor, "--cursor", ""]]) {
    if (t === null || t < view.from || t > view.to) continue;
    const x = pen.x(t);
    c.fillStyle = color(name);
    c.beginPath();
    c.moveTo(x - 6, height - 9);
    c.lineTo(x + 6, height - 9);
    c.lineTo(x, height);
    c.fill();
    c.textAlign = "center";
    c.fillText(text, x, height - 12);
  }
}

function paintOverview() {
  const [c, width, height] = prepare(overview);
  const whole = { from: 0, to: SPAN, scaled: false }, pen = new Pen(c, whole, width, color);
  if (overviewImage === null) {
    drawOverview(pen, height);
    overviewImage = document.createElement("canvas");
    overviewImage.width = overview.width;
    overviewImage.height = overview.height;
    overviewImage.getContext("2d").drawImage(overview, 0, 0);
  } else c.drawImage(overviewImage, 0, 0, width, height);
  const a = Math.max(pen.x(view.from), 0), b = Math.min(pen.x(view.to), width);
  c.fillStyle = color("--paper");
  c.globalAlpha = 0.65;
  c.fillRect(0, 0, a, height);
  c.fillRect(b, 0, width - b, height);
  c.globalAlpha = 1;
  c.strokeStyle = color("--accent");
  c.lineWidth = 1.5;
  c.strokeRect(a + 0.75, 0.75, Math.max(b - a - 1.5, 1), height - 1.5);
  c.fillStyle = color("--cursor");
  c.fillRect(Math.round(pen.x(cursor)), 0, 1, height);
}

function tell() {
  const t = hover ?? cursor, top = channelsElement.scrollTop, bottom = top + channelsElement.clientHeight;
  for (const channel of channels) if (channel.y < bottom && channel.y + channel.height > top) channel.value.textContent = valueText(channel, t);
  const parts = [["Cursor", moment(t)]];
  if (mark !== null) {
    const between = t - mark;
    parts.push(["from the mark", duration(between) + (between ? ` (${number(1e9 / Math.abs(between), 5)} Hz)` : "")]);
  }
  parts.push(["in view", duration(Math.round(Math.min(view.to, SPAN) - Math.max(view.from, 0)))]);
  $("readout").replaceChildren(...parts.map(([name, text]) => {
    const element = document.createElement("span"), bold = document.createElement("b");
    bold.textContent = text;
    element.append(`${name} `, bold);
    return element;
  }));
  followList();
}

// ---------------------------------------------------------------------- keys

const KEYS = {
  ArrowLeft: (e) => moveCursor(cursor - stride(e)),
  ArrowRight: (e) => moveCursor(cursor + stride(e)),
  ArrowUp: () => choose(chosen - 1),
  ArrowDown: () => choose(chosen + 1),
  Enter: (e) => channels[chosen]?.group && fold(channels[chosen].group, e.shiftKey),
  "+": () => zoom(1 / 1.6, cursor),
  "=": () => zoom(1 / 1.6, cursor),
  "-": () => zoom(1.6, cursor),
  "−": () => zoom(1.6, cursor),
  PageUp: () => pan(-(view.to - view.from)),
  PageDown: () => pan(view.to - view.from),
  Home: () => moveCursor(0),
  End: () => moveCursor(SPAN),
  f: fit,
  0: fit,
  n: () => jump(nextChange),
  p: () => jump(previousChange),
  m: () => { mark = mark === cursor ? null : cursor; redraw(); },
  z: zoomToMark,
  y: () => $("scale").click(),
  s: () => $("scene-toggle").click(),
  " ": () => $("play").click(),
  l: () => $("list-toggle").click(),
  "/": () => { openList(true); $("filter").focus(); },
  ".": () => $("wanted").focus(),
  "?": () => $("help").showModal(),
};

function stride(e) {
  const size = view.to - view.from;
  return Math.max(e.altKey ? size / plot.clientWidth : e.shiftKey ? size / 8 : size / 80, 1);
}

function jump(how) {
  const channel = channels[chosen];
  const t = channel && !channel.group ? how(channel, cursor) : null;
  if (t !== null) moveCursor(t);
}

addEventListener("keydown", (e) => {
  if (e.ctrlKey || e.metaKey || $("help").open) return;
  if (e.target instanceof HTMLInputElement) {
    if (e.key === "Escape") plot.focus();
    return;
  }
  if (e.target === $("rows") && rowKeys(e)) return;
  if (e.target instanceof HTMLSelectElement) return;
  if ((e.key === "Enter" || e.key === " ") && e.target instanceof HTMLButtonElement) return;
  const act = KEYS[e.key] ?? KEYS[e.key.toLowerCase()];
  if (!act) return;
  e.preventDefault();
  act(e);
});

// ---------------------------------------------------------------------- mouse

const timeAt = (e) => view.from + (e.clientX - plot.getBoundingClientRect().left) / plot.clientWidth * (view.to - view.from);
const channelAt = (e) => {
  const y = e.clientY - plot.getBoundingClientRect().top + channelsElement.scrollTop;
  return channels.findIndex((channel) => y >= channel.y && y < channel.y + channel.height);
};

plot.addEventListener("wheel", (e) => {
  e.preventDefault();
  const size = view.to - view.from, sideways = e.shiftKey ? e.deltaX || e.deltaY : e.deltaX;
  if (Math.abs(sideways) > Math.abs(e.shiftKey ? 0 : e.deltaY)) pan(sideways / plot.clientWidth * size);
  else zoom(1.0015 ** Math.max(-400, Math.min(e.deltaY * (e.deltaMode === 1 ? 30 : 1), 400)), timeAt(e));
}, { passive: false });

let drag = null;
plot.addEventListener("pointerdown", (e) => {
  if (e.button !== 0) return;
  plot.setPointerCapture(e.pointerId);
  drag = { x: e.clientX, from: view.from, to: view.to, at: timeAt(e), interval: e.shiftKey, moved: false };
});
plot.addEventListener("pointermove", (e) => {
  if (drag) {
    if (Math.abs(e.clientX - drag.x) > 3) drag.moved = true;
    if (!drag.moved) return;
    if (drag.interval) [mark, cursor] = [Math.max(0, Math.round(drag.at)), Math.max(0, Math.min(Math.round(timeAt(e)), SPAN))];
    else {
      plot.classList.add("dragging");
      const by = (drag.x - e.clientX) / plot.clientWidth * (drag.to - drag.from);
      show(drag.from + by, drag.to + by);
    }
  }
  hover = drag?.interval ? null : Math.max(0, Math.min(timeAt(e), SPAN));
  tip(e);
  redraw();
});
plot.addEventListener("pointerup", (e) => {
  if (!drag) return;
  if (drag.interval && drag.moved) zoomToMark();
  else if (!drag.moved) click(e);
  plot.classList.remove("dragging");
  drag = null;
});
plot.addEventListener("pointerleave", () => { hover = null; $("tip").hidden = true; redraw(); });
plot.addEventListener("dblclick", (e) => zoom(1 / 4, timeAt(e)));

function click(e) {
  const i = channelAt(e), t = timeAt(e);
  if (i >= 0) choose(i);
  moveCursor(nearChange(channels[i], t, 6) ?? t, false);
}

// The nearest change of a channel within so many pixels.
function nearChange(channel, t, pixels) {
  if (!channel || channel.group || channel.kind === "still") return null;
  const reach = pixels * (view.to - view.from) / plot.clientWidth;
  const near = [previousChange(channel, t + 1), nextChange(channel, t)].filter((x) => x !== null && Math.abs(x - t) <= reach);
  return near.length ? near.reduce((a, b) => (Math.abs(a - t) <= Math.abs(b - t) ? a : b)) : null;
}

function tip(e) {
  const channel = channels[channelAt(e)], element = $("tip");
  const at = channel?.marks && !drag ? nearChange(channel, timeAt(e), 7) : null;
  element.hidden = at === null;
  if (at === null) return;
  const texts = [];
  for (let i = lastAt(channel.times, 1, at); i >= 0 && channel.times[i] === at && texts.length < 6; i--) {
    const [, , , subject, text] = DATA.marks[channel.marks[i]];
    texts.unshift(text ? `${subject}: ${text}` : subject);
  }
  element.textContent = `${moment(at)}\n${texts.join("\n")}`;
  const box = element.getBoundingClientRect();
  element.style.left = `${Math.min(e.clientX + 14, innerWidth - box.width - 8)}px`;
  element.style.top = `${Math.min(e.clientY + 16, innerHeight - box.height - 8)}px`;
}

let sweeping = false;
const sweep = (e) => {
  const t = (e.clientX - overview.getBoundingClientRect().left) / overview.clientWidth * SPAN, size = view.to - view.from;
  show(t - size / 2, t + size / 2);
};
overview.addEventListener("pointerdown", (e) => { sweeping = true; overview.setPointerCapture(e.pointerId); sweep(e); });
overview.addEventListener("pointermove", (e) => sweeping && sweep(e));
overview.addEventListener("pointerup", () => { sweeping = false; });

channelsElement.addEventListener("scroll", redraw);
$("zoom-in").addEventListener("click", () => zoom(1 / 1.6, cursorOrMiddle()));
$("zoom-out").addEventListener("click", () => zoom(1.6, cursorOrMiddle()));
$("fit").addEventListener("click", fit);
$("scale").addEventListener("click", () => {
  view.scaled = !view.scaled;
  $("scale").setAttribute("aria-pressed", view.scaled);
  redraw();
});
$("help-toggle").addEventListener("click", () => $("help").showModal());
$("list-toggle").addEventListener("click", () => openList($("list").hidden));
$("wanted").addEventListener("input", () => want($("wanted").value));
$("list-close").addEventListener("click", () => openList(false));

function cursorOrMiddle() { return cursor >= view.from && cursor <= view.to ? cursor : (view.from + view.to) / 2; }

// ---------------------------------------------------------------------- the machine

const VIEWS = { iso: "Oblique", front: "Front", side: "Side", top: "Top" };
const replay = DATA.scene && globalThis.steptwinScene ? new steptwinScene.Replay(DATA.scene) : null;
let sceneView = "iso", scenePainted = "", playing = null;

function paintScene() {
  if (replay === null || $("scene").hidden) return;
  const t = hover ?? cursor, { clientWidth: width, clientHeight: height } = $("picture"), key = [t, sceneView, width, height].join();
  if (key === scenePainted) return;
  scenePainted = key;
  const theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
  $("picture").innerHTML = replay.picture(t + DATA.begin, sceneView, theme, Math.max(width, height, 1));
}

function openScene(open) {
  $("scene").hidden = !open;
  $("scene-toggle").setAttribute("aria-pressed", open);
  if (!open) play(false);
  redraw();
}

// As long as it runs, the cursor goes on with the time of the screen.
function play(on) {
  playing = on && replay !== null ? { from: cursor >= SPAN ? 0 : cursor, since: performance.now() } : null;
  $("play").setAttribute("aria-pressed", playing !== null);
  $("play").textContent = playing === null ? "▶" : "❚❚";
  if (playing !== null) requestAnimationFrame(goOn);
}

function goOn(now) {
  if (playing === null) return;
  const t = playing.from + Math.max(now - playing.since, 0) * 1e6 * Number($("speed").value);
  moveCursor(t);
  if (t >= SPAN) play(false);
  else requestAnimationFrame(goOn);
}

if (replay !== null) {
  $("views").append(...Object.entries(VIEWS).map(([name, label]) => {
    const button = document.createElement("button");
    button.textContent = label;
    button.setAttribute("aria-pressed", name === sceneView);
    button.addEventListener("click", () => {
      sceneView = name;
      for (const other of $("views").children) other.setAttribute("aria-pressed", other === button);
      redraw();
    });
    return button;
  }));
  $("scene-toggle").hidden = false;
  $("scene-toggle").addEventListener("click", () => openScene($("scene").hidden));
  $("play").addEventListener("click", () => play(playing === null));
  $("speed").addEventListener("change", () => playing !== null && play(true));
  openScene(true);
}

// ---------------------------------------------------------------------- the list

const ROW = 22;
let listed = DATA.marks.map((_, i) => i), listedTimes = DATA.marks.map((m) => m[0]), current = -1;

function openList(open) {
  $("list").hidden = !open;
  $("list-toggle").setAttribute("aria-pressed", open);
  if (open) filterList();
  else plot.focus();
}

function filterList() {
  const words = $("filter").value.toLowerCase().split(/\s+/).filter(Boolean);
  listed = DATA.marks.map((_, i) => i);
  if (words.length) {
    listed = listed.filter((i) => {
      const text = DATA.marks[i].slice(1).join(" ").toLowerCase();
      return words.every((word) => text.includes(word));
    });
  }
  listedTimes = listed.map((i) => DATA.marks[i][0]);
  $("list-count").textContent = words.length ? `${listed.length} of ${DATA.marks.length}` : `${listed.length} records`;
  $("rows-space").style.height = `${listed.length * ROW}px`;
  current = -2;
  followList();
}

function followList() {
  if ($("list").hidden) return;
  const i = lastAt(listedTimes, 1, cursor);
  if (i === current) return;
  current = i;
  const rows = $("rows"), y = Math.max(i, 0) * ROW;
  if (y < rows.scrollTop || y > rows.scrollTop + rows.clientHeight - 2 * ROW) rows.scrollTop = y - rows.clientHeight / 2;
  paintRows();
}

function paintRows() {
  const rows = $("rows"), first = Math.max(Math.floor(rows.scrollTop / ROW) - 2, 0);
  const last = Math.min(first + Math.ceil(rows.clientHeight / ROW) + 4, listed.length);
  const elements = [$("rows-space")];
  for (let i = first; i < last; i++) {
    const [t, controller, kind, subject, text] = DATA.marks[listed[i]], row = document.createElement("div");
    row.className = "row";
    row.style.top = `${i * ROW}px`;
    row.setAttribute("role", "option");
    if (i === current) row.setAttribute("aria-selected", "true");
    for (const [name, content] of [["time", moment(t)], ["controller", controller], ["kind", kind], ["subject", subject], ["text", text]]) {
      const cell = document.createElement("span");
      cell.className = name === "text" && kind === "frame" ? "text hex" : name;
      cell.textContent = cell.title = content;
      if (name === "kind") cell.style.setProperty("--color", `var(${MARK_COLORS[kind] ?? "--dim"})`);
      row.append(cell);
    }
    row.addEventListener("click", () => goToRow(i));
    elements.push(row);
  }
  rows.replaceChildren(...elements);
}

function goToRow(i) {
  if (i < 0 || i >= listed.length) return;
  moveCursor(listedTimes[i]);
  current = i;
  const rows = $("rows"), y = i * ROW;
  if (y < rows.scrollTop) rows.scrollTop = y;
  else if (y > rows.scrollTop + rows.clientHeight - ROW) rows.scrollTop = y - rows.clientHeight + ROW;
  paintRows();
}

function rowKeys(e) {
  const by = { ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10 }[e.key];
  if (!by) return false;
  e.preventDefault();
  goToRow(Math.max(0, Math.min(current + by, listed.length - 1)));
  return true;
}

$("rows").addEventListener("scroll", paintRows);
$("filter").addEventListener("input", filterList);

// ---------------------------------------------------------------------- the address keeps the view: #at=9.07&span=0.1

let saving = null;
function saveInAddress() {
  clearTimeout(saving);
  saving = setTimeout(() => {
    const at = ((cursor + DATA.begin) / 1e9).toFixed(9), span = ((view.to - view.from) / 1e9).toPrecision(6);
    const channels = wanted.length ? `&channels=${encodeURIComponent(wanted.join(" "))}` : "";
    try { history.replaceState(null, "", `#at=${at}&span=${span}${channels}`); } catch { /* some viewers do not let pages do this */ }
  }, 300);
}

function readAddress() {
  const given = new URLSearchParams(location.hash.slice(1));
  const at = Number(given.get("at")) * 1e9 - DATA.begin, size = Number(given.get("span")) * 1e9;
  $("wanted").value = given.get("channels") ?? "";
  want($("wanted").value);
  fit();
  if (!given.has("at") || !Number.isFinite(at)) return;
  if (size > 0) show(at - size / 2, at + size / 2);
  moveCursor(at);
  if (given.has("list")) openList(true);
}

readAddress();
new ResizeObserver(redraw).observe(plot);
addEventListener("hashchange", readAddress);
