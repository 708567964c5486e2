// Drawing of channels. A pen knows the interval of time in view; every channel costs about as much as there are pixels.

class Pen {
  constructor(context, view, width, color) {
    Object.assign(this, { context, width, color, from: view.from, to: view.to, scaled: view.scaled });
    this.perPixel = (view.to - view.from) / width;
  }
  x(t) { return (t - this.from) / this.perPixel; }
  t(x) { return this.from + x * this.perPixel; }
}

function draw(pen, channel, y) {
  const c = pen.context;
  c.save();
  c.beginPath();
  c.rect(pen.x(0), y, pen.x(SPAN) - pen.x(0), channel.height);
  c.clip();
  c.strokeStyle = c.fillStyle = pen.color(channel.color ?? "--dim");
  c.lineWidth = 1.4;
  c.lineJoin = "round";
  const top = y + 5, bottom = y + channel.height - 5;
  if (channel.kind === "position" || channel.kind === "velocity") drawCurve(pen, channel, top, bottom);
  else if (channel.kind === "step") drawPulses(pen, channel, top, bottom);
  else if (channel.kind === "level") drawLevels(pen, channel, top, bottom);
  else if (channel.kind === "analog") drawAnalog(pen, channel, top, bottom);
  else if (channel.kind === "statement") drawStatements(pen, channel, top, bottom);
  else if (channel.kind === "frames") drawFrames(pen, channel, top, bottom);
  else if (channel.kind === "marks") drawMarks(pen, channel, top, bottom);
  c.restore();
}

// A line through many points: of those in one column of pixels the first, lowest, highest and last.
class Line {
  constructor(context) {
    this.context = context;
    this.column = null;
    context.beginPath();
  }
  to(x, y) {
    const column = Math.floor(x);
    if (column !== this.column) {
      this.flush();
      this.context.lineTo(x, y);
      Object.assign(this, { column, least: y, most: y, last: y, x, many: false });
    } else {
      if (y < this.least) this.least = y;
      if (y > this.most) this.most = y;
      this.last = y;
      this.x = x;
      this.many = true;
    }
  }
  flush() {
    if (this.column === null || !this.many) return;
    this.context.lineTo(this.x, this.least);
    this.context.lineTo(this.x, this.most);
    this.context.lineTo(this.x, this.last);
  }
  stroke() {
    this.flush();
    this.context.stroke();
  }
}

// The curves of a channel on one scale, whose ends are left in `bounds`.
function drawCurve(pen, channel, top, bottom) {
  const velocity = channel.kind === "velocity", c = pen.context;
  let [least, most] = pen.scaled ? rangeOf(channel.curves, velocity, pen.from, pen.to) : channel.range;
  if (velocity) [least, most] = [Math.min(least, 0), Math.max(most, 0)];
  if (!(most > least)) [least, most] = [least - 1, least + 1];
  channel.bounds = [least, most];
  const y = (value) => bottom - (value - least) / (most - least) * (bottom - top);
  if (least <= 0 && most >= 0) {
    c.save();
    c.strokeStyle = pen.color("--rule-strong");
    c.lineWidth = 1;
    c.setLineDash([2, 3]);
    c.beginPath();
    c.moveTo(0, Math.round(y(0)) + 0.5);
    c.lineTo(pen.width, Math.round(y(0)) + 0.5);
    c.stroke();
    c.restore();
  }
  for (const { motion, color, dashed } of channel.curves) {
    c.strokeStyle = pen.color(color);
    c.setLineDash(dashed ? [5, 3] : []);
    const line = new Line(c);
    for (let i = motion.at(pen.from); i < motion.size && motion.begin(i) <= pen.to; i++) {
      const a = Math.max(motion.begin(i), pen.from), b = Math.min(motion.end(i), pen.to);
      const steps = motion.isCurved(i, velocity) ? Math.max(1, Math.ceil((b - a) / pen.perPixel / 3)) : 1;
      for (let k = 0; k <= steps; k++) {
        const t = a + (b - a) * k / steps;
        line.to(pen.x(t), y(velocity ? motion.velocity(i, t) : motion.position(i, t)));
      }
    }
    line.stroke();
  }
  c.setLineDash([]);
}

// The ends of the scale of a channel, beside the plot, where they hide no curve.
function drawBounds(c, channel, y, color) {
  const [least, most] = channel.bounds, unit = 10 ** (Math.floor(Math.log10(most - least)) - 4);
  c.font = '9.5px system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif';
  c.fillStyle = color("--dim");
  for (const [value, at] of [[most, y + 11], [least, y + channel.height - 5]]) {
    c.fillText(number(Math.round(value / unit) * unit, 6), 5, at);
  }
}

// Pulses forward go up, backward down; closer together than three pixels they are a band.
function drawPulses(pen, channel, top, bottom) {
  const { motion } = channel, c = pen.context, middle = (top + bottom) / 2;
  c.globalAlpha = 0.6;
  c.fillRect(0, middle, pen.width, 1);
  c.globalAlpha = 1;
  const wide = Math.max(1, 5000 / pen.perPixel);
  const drawn = { 1: -1, "-1": -1 };
  for (let i = motion.at(pen.from); i < motion.size && motion.begin(i) <= pen.to; i++) {
    const direction = motion.direction(i);
    if (direction === 0) continue;
    const a = Math.max(motion.begin(i), pen.from), b = Math.min(motion.end(i), pen.to);
    // Many motions within a pixel are one line.
    if (pen.x(b) < drawn[direction]) continue;
    drawn[direction] = Math.floor(pen.x(b)) + 1;
    const first = motion.given(i, a) + 1, last = motion.given(i, b);
    if (last < first) continue;
    const high = direction > 0 ? top : middle, tall = middle - top + 1;
    if ((b - a) / pen.perPixel / (last - first + 1) > 3) {
      for (let k = first; k <= last; k++) c.fillRect(pen.x(motion.pulseTime(i, k)), high, wide, tall);
      continue;
    }
    // Where the motion is slow enough, single pulses; the darker the closer they are.
    for (let x = Math.floor(pen.x(a)); x < pen.x(b); x += 4) {
      const from = Math.max(pen.t(x), a), to = Math.min(pen.t(x + 4), b);
      const begin = motion.given(i, from), end = motion.given(i, to);
      if (end - begin > 1) {
        c.globalAlpha = Math.min(0.35 + 0.12 * Math.log2(end - begin), 0.85);
        c.fillRect(pen.x(from), high, Math.max(pen.x(to) - pen.x(from), 1), tall);
        c.globalAlpha = 1;
      } else if (end > begin) c.fillRect(pen.x(motion.pulseTime(i, end)), high, 1, tall);
    }
  }
}

function drawLevels(pen, channel, top, bottom) {
  const { changes, size } = channel.pin, c = pen.context;
  let i = lastAt(changes, 2, pen.from), level = channel.pin.level(pen.from), x = 0;
  const fill = (until, high) => {
    if (high) {
      c.globalAlpha = 0.22;
      c.fillRect(x, top, until - x, bottom - top);
      c.globalAlpha = 1;
    }
    c.fillRect(x, high ? top : bottom - 1, until - x + 1, 1.4);
  };
  for (i += 1; i < size && changes[2 * i] <= pen.to; ) {
    const at = pen.x(changes[2 * i]);
    fill(at, level);
    c.fillRect(at, top, 1.4, bottom - top);
    // Several changes within a pixel are one line.
    const last = Math.max(lastAt(changes, 2, pen.t(at + 1)), i);
    level = changes[2 * last + 1];
    x = at;
    i = last + 1;
  }
  fill(pen.width, level);
}

function drawAnalog(pen, channel, top, bottom) {
  const { changes, size } = channel.pin;
  let [least, most] = pen.scaled ? channel.pin.range(pen.from, pen.to) : channel.range;
  if (!(most > least)) most = least + 1;
  const y = (value) => bottom - (value - least) / (most - least) * (bottom - top);
  let level = channel.pin.level(pen.from);
  const line = new Line(pen.context);
  if (level !== null) line.to(0, y(level));
  for (let i = lastAt(changes, 2, pen.from) + 1; i < size && changes[2 * i] <= pen.to; i++) {
    const x = pen.x(changes[2 * i]);
    if (level !== null) line.to(x, y(level));
    level = changes[2 * i + 1];
    line.to(x, y(level));
  }
  if (level !== null) line.to(pen.width, y(level));
  line.stroke();
  channel.bounds = [least, most];
}

// Marks in view: calls back with index, x, and the x of the next one.
function eachMark(pen, channel, from, visit) {
  const { times } = channel;
  for (let i = Math.max(lastAt(times, 1, from), 0); i < times.length && times[i] <= pen.to; ) {
    const x = pen.x(times[i]);
    const last = Math.max(lastAt(times, 1, pen.t(x + 1)), i);
    visit(last, x, last + 1 < times.length ? pen.x(times[last + 1]) : pen.width + 1e6);
    i = last + 1;
  }
}

const LEGIBLE = 26;

function label(c, text, x, y, room, font) {
  if (room < LEGIBLE) return;
  c.font = font;
  const perCharacter = c.measureText("0").width, fits = Math.floor((room - 6) / perCharacter);
  c.fillText(text.length <= fits ? text : `${text.slice(0, Math.max(fits - 1, 1))}…`, x + 4, y);
}

const SMALL = '11px system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif';
const MONO = '10.5px ui-monospace, "DejaVu Sans Mono", monospace';

function drawMarks(pen, channel, top, bottom) {
  const c = pen.context;
  eachMark(pen, channel, pen.from - 400 * pen.perPixel, (i, x, next) => {
    c.fillRect(x - 0.7, top, 1.4, bottom - top);
    const [, , , subject, text] = DATA.marks[channel.marks[i]];
    label(c, text || subject, x, bottom - 3, next - x, SMALL);
  });
}

function drawStatements(pen, channel, top, bottom) {
  const c = pen.context;
  eachMark(pen, channel, pen.from, (i, x, next) => {
    const end = Math.min(next, pen.width + 2), begin = Math.max(x, -2);
    c.globalAlpha = 0.16;
    c.fillRect(begin, top, end - begin, bottom - top);
    c.globalAlpha = 1;
    c.fillRect(x - 0.5, top, 1, bottom - top);
    label(c, DATA.marks[channel.marks[i]][4].replace("line ", ""), begin, bottom - 3, Math.min(end - begin, 400), SMALL);
  });
}

// What goes into the controller above, what comes out below.
function drawFrames(pen, channel, top, bottom) {
  const c = pen.context, middle = (top + bottom) / 2;
  for (const [end, color, high] of [["in", "--in", top], ["out", "--out", middle + 1]]) {
    channel[end] ??= split(channel, end);
    c.fillStyle = pen.color(color);
    eachMark(pen, channel[end], pen.from - 400 * pen.perPixel, (i, x, next) => {
      c.fillRect(x - 0.7, high, 1.4, middle - top - 1);
      label(c, DATA.marks[channel[end].marks[i]][4], x, high + middle - top - 4, next - x, MONO);
    });
  }
}

function split(channel, end) {
  const chosen = channel.marks.filter((index) => (DATA.marks[index][3].split("/")[1] ?? "in") === end);
  return { marks: chosen, times: chosen.map((index) => DATA.marks[index][0]) };
}

// ---------------------------------------------------------------------- the scale of time

// Ticks 1, 2 or 5 times a power of ten nanoseconds apart; above a minute in minutes and hours.
function tickStep(perPixel, room) {
  const least = perPixel * room;
  for (const minutes of [1, 2, 5, 10, 15, 30, 60, 120, 360, 720, 1440]) {
    if (least > 20e9 && minutes * 60e9 >= least) return minutes * 60e9;
  }
  const power = 10 ** Math.floor(Math.log10(Math.max(least, 1)));
  return [1, 2, 5, 10].map((n) => n * power).find((step) => step >= least) ?? 10 * power;
}

// What ticks are called, and from where they count where the whole number would be too long.
function tickNames(view, step) {
  const clock = view.to - view.from > 300e9;
  if (clock) {
    return [0, (t) => {
      const s = Math.round((t + DATA.begin) / 1e9);
      return `${Math.floor(s / 3600)}:${String(Math.floor(s / 60) % 60).padStart(2, "0")}:${String(s % 60).padStart(2, "0")}`;
    }];
  }
  if (step >= 1e5) {
    const digits = Math.max(0, 9 - Math.floor(Math.log10(step) + 1e-9));
    return [0, (t) => `${((t + DATA.begin) / 1e9).toFixed(digits).replace("-", "−")} s`];
  }
  const big = 10 ** Math.ceil(Math.log10(view.to - view.from) + 0.5);
  const origin = Math.floor((view.from + DATA.begin) / big) * big;
  const [unit, name] = step >= 1e3 ? [1e3, "µs"] : [1, "ns"];
  return [origin, (t) => `+${number((t + DATA.begin - origin) / unit, 9)} ${name}`];
}

function drawRuler(pen, view, height) {
  const c = pen.context, step = tickStep(pen.perPixel, 90);
  const [origin, name] = tickNames(view, step);
  c.font = SMALL;
  c.textAlign = "center";
  const first = Math.ceil((view.from + DATA.begin) / step) * step - DATA.begin;
  for (let t = first; t <= view.to; t += step) {
    const x = Math.round(pen.x(t)) + 0.5;
    c.fillStyle = pen.color("--rule-strong");
    c.fillRect(x, height - 7, 1, 7);
    c.fillStyle = pen.color("--dim");
    c.fillText(name(t), Math.min(Math.max(x, 26), pen.width - 26), height - 12);
  }
  c.fillStyle = pen.color("--rule-strong");
  c.fillRect(0, height - 1, pen.width, 1);
  return origin;
}

function drawGrid(pen, view, height) {
  const c = pen.context, step = tickStep(pen.perPixel, 90);
  c.fillStyle = pen.color("--rule");
  const first = Math.ceil((view.from + DATA.begin) / step) * step - DATA.begin;
  for (let t = first; t <= view.to; t += step) c.fillRect(Math.round(pen.x(t)), 0, 1, height);
}

// Of a controller that is folded: how fast the fastest of its axes is, and where something happened.
function drawSummary(pen, { motions, marks }, top, bottom) {
  const c = pen.context, begin = Math.max(pen.x(0), 0), end = Math.min(pen.x(SPAN), pen.width);
  c.fillStyle = pen.color("--velocity");
  c.globalAlpha = 0.45;
  for (let x = begin; x < end; x += 2) {
    let speed = 0;
    for (const { motion, fastest } of motions) {
      const [least, most] = motion.range(true, pen.t(x), pen.t(Math.min(x + 2, end)));
      speed = Math.max(speed, -least / fastest, most / fastest);
    }
    if (speed > 0) c.fillRect(x, bottom - Math.max(speed * (bottom - top), 1), 2, Math.max(speed * (bottom - top), 1));
  }
  c.globalAlpha = 1;
  let drawn = -1;
  for (const [t, , kind] of marks) {
    const x = Math.floor(pen.x(t)), minor = kind === "frame" || kind === "statement";
    if (t < pen.from || t > pen.to || (x <= drawn && minor)) continue;
    drawn = x;
    c.fillStyle = pen.color(MARK_COLORS[kind]);
    c.fillRect(x, minor ? bottom - 4 : bottom - 8, 1, minor ? 4 : 8);
  }
}

// The whole run: how fast the axes are, and where something happened.
function drawOverview(pen, height) {
  const c = pen.context, motions = DATA.axes.slice(0, 64).map((axis) => new Motion(axis)).filter((motion) => motion.moves());
  const bands = motions.slice(0, 8).map((motion) => ({ motion, range: motion.range(true, 0, SPAN) })), tall = (height - 14) / Math.max(bands.length, 1);
  bands.forEach(({ motion, range }, row) => {
    const fastest = Math.max(Math.abs(range[0]), Math.abs(range[1])) || 1, bottom = 4 + (row + 1) * tall;
    c.fillStyle = pen.color("--velocity");
    c.globalAlpha = 0.55;
    for (let x = 0; x < pen.width; x += 2) {
      const [least, most] = motion.range(true, pen.t(x), pen.t(x + 2));
      const speed = Math.max(Math.abs(least), Math.abs(most)) / fastest;
      if (speed > 0) c.fillRect(x, bottom - Math.max(speed * (tall - 1), 1), 2, Math.max(speed * (tall - 1), 1));
    }
  });
  c.globalAlpha = 0.9;
  let until = -1;
  for (const [t, , kind] of DATA.marks) {
    const x = Math.floor(pen.x(t));
    if (x <= until && kind === "frame") continue;
    until = x;
    c.fillStyle = pen.color(MARK_COLORS[kind]);
    c.fillRect(x, kind === "frame" ? height - 5 : height - 8, 1, kind === "frame" ? 4 : 7);
  }
  c.globalAlpha = 1;
}
