// What the file knows, and questions about it. Times are nanoseconds from the beginning of the window.

const DATA = JSON.parse(document.getElementById("data").textContent);
const SPAN = Math.max(DATA.span, 1);

// The last index whose time is <= t in a flat list of records of `size` numbers, -1 if there is none.
function lastAt(flat, size, t) {
  let low = 0, high = flat.length / size;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (flat[middle * size] <= t) low = middle + 1; else high = middle;
  }
  return low - 1;
}

// Position and velocity, in pulses, on a segment of a plan `t` seconds after its start: docs/control.md has the formulas.
function polynomial([, anchor, c0, c1, c2, c3], t) {
  const u = t - anchor;
  return [c0 + u * (c1 + u * (c2 + u * c3)), c1 + u * (2 * c2 + u * 3 * c3)];
}

const QUARTER = Math.PI / 2;

function onSegment(segment, t) {
  if (Array.isArray(segment)) return polynomial(segment, t);
  const [centre, radius, angle, turn] = segment.course, [way, speed] = polynomial(segment.way, t);
  const phi = (angle + turn * way) * QUARTER;
  return [centre + radius * Math.cos(phi), -radius * Math.sin(phi) * turn * QUARTER * speed];
}

// The motion of an axis: plans, and pieces of them, six numbers each (begin, plan, segment, count, direction, grid).
const PIECE = 6;
const MOST_SAMPLES = 1000;

class Motion {
  constructor(axis) {
    this.plans = axis.plans.map((plan) => ({ ...plan, start: Number(BigInt(plan.start_ns) - BigInt(DATA.begin)) }));
    this.pieces = axis.pieces;
    this.size = axis.pieces.length / PIECE;
    this.scale = axis.scale;
    this.digits = axis.digits ?? (axis.scale === 1 ? 1 : 3);
  }
  at(t) { return Math.max(lastAt(this.pieces, PIECE, t), 0); }
  begin(i) { return this.pieces[i * PIECE]; }
  end(i) { return i + 1 < this.size ? this.pieces[(i + 1) * PIECE] : SPAN; }
  plan(i) { return this.plans[this.pieces[i * PIECE + 1]]; }
  // null at rest.
  segment(i) { return this.plan(i).segments[this.pieces[i * PIECE + 2]] ?? null; }
  counted(i) { return this.pieces[i * PIECE + 3]; }
  direction(i) { return this.pieces[i * PIECE + 4]; }
  grid(i) { return this.pieces[i * PIECE + 5]; }
  look(i, t) {
    const plan = this.plan(i), segment = this.segment(i);
    if (segment === null) return [plan.base + plan.final, 0];
    const [position, velocity] = onSegment(segment, (t - plan.start) / 1e9);
    return [plan.base + position, velocity];
  }
  pulses(i, t) { return this.look(i, t)[0]; }
  position(i, t) { return this.look(i, t)[0] / this.scale; }
  velocity(i, t) { return this.look(i, t)[1] / this.scale; }
  isCurved(i, velocity) {
    const segment = this.segment(i);
    if (segment === null) return false;
    return !Array.isArray(segment) || segment[5] !== 0 || (!velocity && segment[4] !== 0);
  }
  // Into how many parts piece i is divided between a and b to find its least and most: an eighth of a quarter turn each on an arc.
  parts(i, velocity, a, b) {
    if (!this.isCurved(i, velocity)) return 1;
    const segment = this.segment(i), seconds = (t) => (t - this.plan(i).start) / 1e9;
    if (Array.isArray(segment)) return 3;
    const turned = segment.course[3] * (polynomial(segment.way, seconds(b))[0] - polynomial(segment.way, seconds(a))[0]);
    return Math.min(Math.ceil(Math.abs(turned) * 8) + 3, MOST_SAMPLES);
  }
  moves() {
    for (let i = 0; i < this.size; i++) if (this.direction(i) !== 0) return true;
    return false;
  }
  // Whether the position changes at all, with pulses or without.
  changes() {
    const [least, most] = this.range(false, 0, SPAN);
    return most > least;
  }
  // STEP pulses given within piece i up to t.
  given(i, t) {
    const direction = this.direction(i), grid = this.grid(i), count = this.counted(i);
    if (direction === 0) return 0;
    const all = i + 1 < this.size ? Math.round((this.counted(i + 1) - count) * direction / grid) : Infinity;
    if (t >= this.end(i) && all !== Infinity) return Math.max(all, 0);
    return Math.max(Math.min(Math.floor((this.pulses(i, t) - count) * direction / grid + 1e-9), all), 0);
  }
  count(t) {
    const i = this.at(t);
    return this.counted(i) + this.direction(i) * this.grid(i) * this.given(i, t);
  }
  // The moment of pulse number k (from 1) of piece i.
  pulseTime(i, k) {
    const direction = this.direction(i), wanted = (this.counted(i) + direction * this.grid(i) * k) * direction;
    let low = this.begin(i), high = this.end(i);
    while (high - low > 0.5) {
      const middle = (low + high) / 2;
      if (this.pulses(i, middle) * direction >= wanted) high = middle; else low = middle;
    }
    return Math.ceil(low);
  }
  nextPulse(t) {
    for (let i = this.at(t); i < this.size; i++) {
      const k = (i === this.at(t) ? this.given(i, t) : 0) + 1;
      if (this.direction(i) !== 0 && k <= this.given(i, this.end(i))) return Math.max(this.pulseTime(i, k), t + 1);
    }
    return null;
  }
  previousPulse(t) {
    for (let i = this.at(t - 1); i >= 0; i--) {
      const k = this.given(i, Math.min(t - 1, this.end(i)));
      if (k > 0) return Math.min(this.pulseTime(i, k), t - 1);
    }
    return null;
  }
  // Least and most of position or velocity in an interval.
  range(velocity, from, to) {
    let least = Infinity, most = -Infinity;
    for (let i = this.at(from); i < this.size && this.begin(i) <= to; i++) {
      const a = Math.max(this.begin(i), from), b = Math.min(this.end(i), to);
      const parts = this.parts(i, velocity, a, b);
      for (let n = 0; n <= parts; n++) {
        const t = a + (b - a) * n / parts, value = velocity ? this.velocity(i, t) : this.position(i, t);
        if (value < least) least = value;
        if (value > most) most = value;
      }
    }
    return [least, most];
  }
}

class Pin {
  constructor(pin) {
    this.changes = pin.changes;
    this.before = pin.before;
    this.size = pin.changes.length / 2;
  }
  level(t) {
    const i = lastAt(this.changes, 2, t);
    return i < 0 ? this.before : this.changes[2 * i + 1];
  }
  range(from, to) {
    const levels = [0, this.level(from) ?? 0];
    for (let i = lastAt(this.changes, 2, from) + 1; i < this.size && this.changes[2 * i] <= to; i++) levels.push(this.changes[2 * i + 1]);
    return [levels.reduce((a, b) => Math.min(a, b)), levels.reduce((a, b) => Math.max(a, b))];
  }
}

// ---------------------------------------------------------------------- channels

// What a controller does, for the row of one that is folded.
function summaryOf(controller) {
  const motions = DATA.axes.filter((axis) => axis.controller === controller).map((axis) => new Motion(axis)).filter((motion) => motion.moves());
  const fastest = (motion) => Math.max(...motion.range(true, 0, SPAN).map(Math.abs)) || 1;
  return { motions: motions.map((motion) => ({ motion, fastest: fastest(motion) })), marks: DATA.marks.filter((mark) => mark[1] === controller) };
}

const HEIGHTS = { group: 28, still: 22, position: 62, velocity: 46, step: 26, level: 24, analog: 40, frames: 40, statement: 24, marks: 24 };
const COLORS = { position: "--position", true: "--true", velocity: "--velocity", step: "--step", level: "--level", analog: "--analog", frames: "--out", statement: "--statement" };
const MARK_COLORS = { frame: "--in", statement: "--statement", event: "--event", input: "--input", fault: "--fault" };
const MARK_NAMES = { event: "events", input: "inputs", fault: "faults" };

function rangeOf(curves, velocity, from, to) {
  const ranges = curves.map(({ motion }) => motion.range(velocity, from, to));
  return [Math.min(...ranges.map(([least]) => least)), Math.max(...ranges.map(([, most]) => most))];
}

// All channels of a controller, in the order in which they are shown. Times of marks are in a flat list of their own for searching.
function channelsOf(controller) {
  const channels = [];
  const still = [];
  for (const axis of DATA.axes.filter((axis) => axis.controller === controller)) {
    const motion = new Motion(axis), load = axis.true && new Motion(axis.true), curve = { motion, color: COLORS.position };
    const common = { controller, motion, unit: axis.unit, first: channels.length === 0 };
    const moves = motion.moves(), count = axis.counted ? new Motion(axis.counted) : motion;
    if (!moves && !load?.changes() && !axis.counted) {
      const stands = motion.position(0, 0) === 0 ? "" : ` at ${positionText(motion, 0)} ${axis.unit}`;
      still.push(`${axis.name}${stands}`);
      continue;
    }
    const position = { ...common, kind: "position", name: `${axis.name} position`, curves: [curve] };
    channels.push(position);
    if (load) {
      const its = { motion: load, color: COLORS.true };
      // In one channel where both have the same unit; the true one is dashed, so that both are seen where they agree.
      if (axis.true.unit === axis.unit) {
        position.name += `, ${axis.true.name}`;
        position.curves.push({ ...its, dashed: true });
      } else {
        channels.push({ controller, motion: load, unit: axis.true.unit, kind: "position", isTrue: true, name: `${axis.true.name} position`, curves: [its] });
      }
    }
    if (axis.counted) {
      const its = { motion: count, color: COLORS.position };
      channels.push({ controller, motion: count, unit: axis.unit, kind: "position", name: `${axis.name} since power-on`, curves: [its] });
    }
    if (!moves) continue;
    channels.push({ ...common, kind: "velocity", name: `${axis.name} velocity`, curves: [{ motion, color: COLORS.velocity }], first: false });
    channels.push({ ...common, motion: count, kind: "step", name: `${axis.name} pulses`, first: false });
  }
  for (const moved of DATA.moved.filter((one) => one.controller === controller)) {
    const motion = new Motion(moved), curves = [{ motion, color: COLORS.true }];
    if (motion.changes()) channels.push({ controller, motion, unit: moved.unit, kind: "position", isTrue: true, name: moved.name, curves });
    else still.push(`${moved.name} ${positionText(motion, 0)} ${moved.unit}`);
  }
  for (const channel of channels) if (channel.curves) channel.range = rangeOf(channel.curves, channel.kind === "velocity", 0, SPAN);
  if (still.length) {
    channels.push({ controller, kind: "still", name: `no motion: ${still.join(", ")}`, first: channels.length === 0 });
  }
  const pins = DATA.pins.filter((pin) => pin.controller === controller);
  pins.forEach((pin, i) => {
    const data = new Pin(pin);
    channels.push({ controller, kind: pin.analog ? "analog" : "level", name: pin.name, pin: data, first: i === 0, range: data.range(0, SPAN) });
  });
  const groups = new Map();
  DATA.marks.forEach((mark, index) => {
    const [, its, kind, subject] = mark;
    if (its !== controller) return;
    const name = kind === "frame" ? subject.split("/")[0] : kind === "statement" ? subject : MARK_NAMES[kind] ?? kind;
    const key = `${kind} ${name}`;
    if (!groups.has(key)) {
      const channel = kind === "frame" ? "frames" : kind === "statement" ? "statement" : "marks";
      groups.set(key, { controller, kind: channel, name, mark: kind, times: [], marks: [], first: groups.size === 0 });
    }
    groups.get(key).times.push(mark[0]);
    groups.get(key).marks.push(index);
  });
  channels.push(...groups.values());
  for (const channel of channels) {
    channel.height = HEIGHTS[channel.kind];
    channel.color = channel.isTrue ? COLORS.true : COLORS[channel.kind] ?? MARK_COLORS[channel.mark];
  }
  return channels;
}

function nextChange(channel, t) {
  if (channel.kind === "step") return channel.motion.nextPulse(t);
  const [flat, size] = flatOf(channel);
  const i = lastAt(flat, size, t) + 1;
  return i * size < flat.length ? flat[i * size] : null;
}

function previousChange(channel, t) {
  if (channel.kind === "step") return channel.motion.previousPulse(t);
  const [flat, size] = flatOf(channel);
  const i = lastAt(flat, size, t - 0.5);
  return i >= 0 ? flat[i * size] : null;
}

function flatOf(channel) {
  if (channel.kind === "still") return [[], 1];
  return channel.motion ? [channel.motion.pieces, PIECE] : channel.pin ? [channel.pin.changes, 2] : [channel.times, 1];
}

// ---------------------------------------------------------------------- texts

function number(value, most = 6) {
  if (value === null || value === undefined || Number.isNaN(value)) return "?";
  const text = Math.abs(value) < 1e15 ? Number(value.toPrecision(most)).toString() : value.toExponential(3);
  return (text === "-0" ? "0" : text).replace("-", "−");
}

function positionText(motion, t) {
  return motion.position(motion.at(t), t).toFixed(motion.digits).replace("-", "−");
}

function valueText(channel, t) {
  switch (channel.kind) {
    case "position": return `${channel.curves.map(({ motion }) => positionText(motion, t)).join(" / ")} ${channel.unit}`;
    case "still": return "";
    case "velocity": return `${number(channel.motion.velocity(channel.motion.at(t), t), 5)} ${channel.unit}/s`;
    case "step": return number(channel.motion.count(t), 15);
    case "level": return channel.pin.level(t) ? "1" : "0";
    case "analog": return number(channel.pin.level(t), 5) + (channel.name.startsWith("AIN") ? " V" : "");
    case "group": return "";
  }
  const i = lastAt(channel.times, 1, t);
  if (i < 0) return "";
  const text = DATA.marks[channel.marks[i]][4];
  return channel.kind === "statement" ? text : `${i + 1} of ${channel.times.length}`;
}

// A moment as seconds with nine digits in groups: 9.070 000 012 s
function moment(t) {
  const ns = Math.round(t + DATA.begin), sign = ns < 0 ? "−" : "";
  const whole = Math.floor(Math.abs(ns) / 1e9), rest = String(Math.abs(ns) % 1e9).padStart(9, "0");
  return `${sign}${whole}.${rest.slice(0, 3)}\u2009${rest.slice(3, 6)}\u2009${rest.slice(6)} s`;
}

function duration(ns) {
  const size = Math.abs(ns);
  const [unit, name] = size >= 1e9 ? [1e9, "s"] : size >= 1e6 ? [1e6, "ms"] : size >= 1e3 ? [1e3, "µs"] : [1, "ns"];
  return `${number(ns / unit, 9)} ${name}`;
}
