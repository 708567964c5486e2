// A host of Sparkplug B that takes requests as lines of JSON and answers each with one line. It checks the order of what it
// receives by the rules of the specification (3.0): births before data, seq without a gap, the bdSeq of births and deaths.
const readline = require("node:readline");
const mqtt = require("mqtt");
const codec = require("sparkplug-payload").get("spBv1.0");

let client;
const seen = [];
const nodes = new Map();
const violations = [];

const plain = (value) => {
  if (value === null || value === undefined || typeof value === "boolean" || typeof value === "string") return value ?? null;
  return typeof value === "number" ? value : Number(value);
};
const readable = (metric) => ({
  name: metric.name ?? null,
  alias: plain(metric.alias),
  type: metric.type ?? null,
  value: plain(metric.value),
  time: plain(metric.timestamp),
  historical: metric.isHistorical === true,
  properties: Object.fromEntries(Object.entries(metric.properties ?? {}).map(([key, one]) => [key, plain(one.value)])),
});

function bear(owner, place, metrics) {
  owner.isAlive = true;
  owner.names = new Map();
  owner.values = {};
  for (const metric of metrics) {
    if (metric.name === null) violations.push(`${place}: a metric of a birth has no name`);
    if (metric.type === null) violations.push(`${place}: ${metric.name} has no type`);
    if (metric.alias !== null) owner.names.set(metric.alias, metric.name);
    owner.values[metric.name] = metric.value;
  }
}

function take(owner, place, metrics) {
  for (const metric of metrics) {
    const name = owner.names.get(metric.alias);
    if (metric.name !== null) violations.push(`${place}: ${metric.name} has a name beside its alias`);
    if (name === undefined) violations.push(`${place}: alias ${metric.alias} has not been born`);
    else if (!metric.historical) owner.values[name] = metric.value;
    metric.name = name ?? null;
  }
}

function receive(topic, data, packet) {
  const [, group, kind, name, device] = topic.split("/");
  if (group === "STATE" || kind.endsWith("CMD")) return;
  const payload = codec.decodePayload(data);
  const metrics = (payload.metrics ?? []).map(readable);
  const seq = plain(payload.seq);
  const place = `${seen.length} ${kind} ${device ?? ""}`.trim();
  const node = nodes.get(name) ?? { isAlive: false, devices: new Map(), bdSeq: null };
  nodes.set(name, node);
  if (packet.retain) violations.push(`${place}: it is retained`);
  if (packet.qos !== 0 && kind !== "NDEATH") violations.push(`${place}: QoS ${packet.qos}`);
  const bdSeq = metrics.find((one) => one.name === "bdSeq")?.value ?? null;
  if (kind === "NDEATH") {
    if (seq !== null) violations.push(`${place}: a death of a node has no seq`);
    if (bdSeq === node.bdSeq) node.isAlive = false;
    for (const one of node.devices.values()) one.isAlive = node.isAlive && one.isAlive;
  } else if (kind === "NBIRTH") {
    if (seq !== 0) violations.push(`${place}: seq ${seq} instead of 0`);
    if (bdSeq === null) violations.push(`${place}: no bdSeq`);
    if (node.isAlive ? bdSeq !== node.bdSeq : node.bdSeq !== null && bdSeq !== (node.bdSeq + 1) % 256 && !node.isStale) {
      violations.push(`${place}: bdSeq ${bdSeq} after ${node.bdSeq}`);
    }
    if (!metrics.some((one) => one.name === "Node Control/Rebirth" && one.value === false)) violations.push(`${place}: no rebirth`);
    Object.assign(node, { bdSeq, seq: 0, devices: new Map(), isStale: false });
    bear(node, place, metrics);
  } else {
    if (!node.isAlive) violations.push(`${place}: its node is not born`);
    if (seq !== (node.seq + 1) % 256) violations.push(`${place}: seq ${seq} after ${node.seq}`);
    node.seq = seq;
    const owner = device === undefined ? node : (node.devices.get(device) ?? { isAlive: false, names: new Map(), values: {} });
    if (device !== undefined) node.devices.set(device, owner);
    if (kind === "DBIRTH") bear(owner, place, metrics);
    else if (!owner.isAlive) violations.push(`${place}: it is not born`);
    else if (kind === "DDEATH") owner.isAlive = false;
    else take(owner, place, metrics);
  }
  seen.push({ kind, node: name, device: device ?? null, seq, bdSeq, time: plain(payload.timestamp), metrics });
}

const done = (act) => new Promise((resolve, reject) => act((error) => (error ? reject(error) : resolve())));
const actions = {
  async connect({ url }) {
    client = mqtt.connect(url, { protocolVersion: 5, reconnectPeriod: 100 });
    client.on("message", receive);
    client.on("error", () => {});
    // Without the broker nothing is known of the nodes, which may have tried to connect several times.
    client.on("close", () => nodes.forEach((node) => Object.assign(node, { isAlive: false, isStale: true })));
    await new Promise((resolve) => client.once("connect", resolve));
    await done((then) => client.subscribe("spBv1.0/#", { qos: 1 }, then));
    return "connected";
  },
  async connected() {
    return client.connected;
  },
  async seen() {
    return seen.splice(0);
  },
  async violations() {
    return violations;
  },
  async value({ node, device, name }) {
    const found = nodes.get(node);
    const owner = device ? found?.devices.get(device) : found;
    return { alive: owner?.isAlive ?? false, value: owner?.values?.[name] ?? null };
  },
  async command({ group, node, device, metrics, retain }) {
    const kind = device ? `DCMD/${node}/${device}` : `NCMD/${node}`;
    const data = codec.encodePayload({ timestamp: Date.now(), metrics });
    await done((then) => client.publish(`spBv1.0/${group}/${kind}`, Buffer.from(data), { qos: 0, retain: retain === true }, then));
    return "sent";
  },
  // By alias alone, as hosts may do.
  async write({ group, node, device, name, type, value }) {
    const [alias] = [...nodes.get(node).devices.get(device).names].find(([, one]) => one === name);
    return actions.command({ group, node, device, metrics: [{ alias, type, value }] });
  },
  async state({ host, online, timestamp }) {
    const payload = JSON.stringify({ online, timestamp });
    await done((then) => client.publish(`spBv1.0/STATE/${host}`, payload, { qos: 1, retain: true }, then));
    return "sent";
  },
  async encode({ payload }) {
    return Buffer.from(codec.encodePayload(payload)).toString("hex");
  },
  async decode({ hex }) {
    const found = codec.decodePayload(Buffer.from(hex, "hex"));
    return { seq: plain(found.seq), time: plain(found.timestamp), metrics: (found.metrics ?? []).map(readable) };
  },
  async close() {
    await client?.endAsync(true);
    return "closed";
  },
};

const lines = readline.createInterface({ input: process.stdin });
let last = Promise.resolve();
lines.on("line", (line) => {
  last = last.then(async () => {
    const request = JSON.parse(line);
    let answer;
    try {
      answer = { ok: await actions[request.do](request) };
    } catch (error) {
      answer = { error: String(error.message ?? error) };
    }
    await new Promise((written) => process.stdout.write(`@${JSON.stringify(answer)}\n`, written));
    if (request.do === "close") process.exit(0);
  });
});
