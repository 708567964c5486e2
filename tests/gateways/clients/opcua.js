// A client of OPC UA that takes requests as lines of JSON and answers each with one line.
const readline = require("node:readline");
const {
  AttributeIds,
  AggregateFilter,
  ClientMonitoredItem,
  DataChangeFilter,
  DataChangeTrigger,
  DataType,
  HistoryData,
  HistoryReadRequest,
  MessageSecurityMode,
  OPCUAClient,
  ReadRawModifiedDetails,
  SecurityPolicy,
  StatusCodes,
  TimestampsToReturn,
  UserTokenType,
  constructEventFilter,
} = require("node-opcua-client");
const { NumericRange } = require("node-opcua-numeric-range");
const { OPCUACertificateManager } = require("node-opcua-certificate-manager");

let client, session, subscription;
const seen = [];

const types = { boolean: DataType.Boolean, double: DataType.Double, text: DataType.String };
const variant = ({ type, value }) => ({ dataType: types[type], value: type === "double" ? Number(value) : value });
const plain = (value) => ({
  value: typeof value.value?.value === "bigint" || Array.isArray(value.value?.value) ? String(value.value.value) : (value.value?.value ?? null),
  type: value.value ? DataType[value.value.dataType] : null,
  status: value.statusCode.name,
  time: value.sourceTimestamp ? value.sourceTimestamp.getTime() : null,
});

/** `{ band, type }` and `{ trigger }` are data changes, `{ average }` an aggregate over so many ms. */
const filterOf = (filter) => {
  if (filter === undefined) return undefined;
  if (filter.average !== undefined)
    return new AggregateFilter({
      startTime: new Date(),
      aggregateType: "ns=0;i=2342",
      processingInterval: filter.average,
      aggregateConfiguration: { useServerCapabilitiesDefaults: true },
    });
  const trigger = DataChangeTrigger[filter.trigger ?? "StatusValue"];
  return new DataChangeFilter({ trigger, deadbandType: filter.type ?? 0, deadbandValue: filter.band ?? 0 });
};

const actions = {
  async connect({ url, mode, policy, folder, user, password }) {
    const manager = new OPCUACertificateManager({ rootFolder: folder, automaticallyAcceptUnknownCertificate: true });
    await manager.initialize();
    client = OPCUAClient.create({
      endpointMustExist: false,
      securityMode: mode ? MessageSecurityMode[mode] : MessageSecurityMode.None,
      securityPolicy: policy ? SecurityPolicy[policy] : SecurityPolicy.None,
      clientCertificateManager: manager,
      connectionStrategy: { maxRetry: 0 },
    });
    await client.connect(url);
    const identity = user ? { type: UserTokenType.UserName, userName: user, password } : undefined;
    session = await client.createSession(identity);
    return client.endpoint?.securityPolicyUri ?? "";
  },
  async browse({ node }) {
    const found = await session.browse(node);
    return found.references.map((one) => [one.browseName.toString(), one.nodeId.toString(), one.nodeClass]);
  },
  async read({ node, attribute, range }) {
    const indexRange = range === undefined ? undefined : new NumericRange(range);
    return plain(await session.read({ nodeId: node, attributeId: AttributeIds[attribute ?? "Value"], indexRange }));
  },
  async write({ node, value, status = "Good" }) {
    const written = { statusCode: StatusCodes[status], value: variant(value) };
    const code = await session.write({ nodeId: node, attributeId: AttributeIds.Value, value: written });
    return code.name;
  },
  async call({ object, method, given }) {
    const found = await session.call({ objectId: object, methodId: method, inputArguments: given.map(variant) });
    return found.statusCode.name;
  },
  async history({ node, start, end, most = 0 }) {
    const options = { numValuesPerNode: most, returnBounds: false };
    const found = await session.readHistoryValue(node, new Date(start), new Date(end), options);
    const values = found.historyData?.dataValues ?? [];
    const plainest = (one) => [one.sourceTimestamp.toISOString(), one.value?.value ?? null, one.statusCode.name];
    return { status: found.statusCode.name, more: !!found.continuationPoint?.length, values: values.map(plainest) };
  },
  /** All pages; `first`: the continuation point of the first request. */
  async pages({ node, start, end, most, first }) {
    const pages = [];
    let continuationPoint = first === undefined ? undefined : Buffer.from(first);
    do {
      const request = new HistoryReadRequest({
        historyReadDetails: new ReadRawModifiedDetails({
          startTime: new Date(start),
          endTime: new Date(end),
          numValuesPerNode: most,
        }),
        nodesToRead: [{ nodeId: node, continuationPoint }],
      });
      const [found] = (await session.historyRead(request)).results;
      if (found.statusCode.isNot(StatusCodes.Good)) return found.statusCode.name;
      pages.push(found.historyData.dataValues.map((one) => one.value.value));
      continuationPoint = found.continuationPoint;
    } while (continuationPoint?.length);
    return pages;
  },
  async subscribe({ node, period, filter }) {
    subscription ??= await session.createSubscription2({
      requestedPublishingInterval: period,
      requestedMaxKeepAliveCount: 20,
      requestedLifetimeCount: 100,
      publishingEnabled: true,
    });
    const item = await subscription.monitor(
      { nodeId: node, attributeId: AttributeIds.Value },
      { samplingInterval: period, queueSize: 1000, discardOldest: true, filter: filterOf(filter) },
      TimestampsToReturn.Both,
    );
    item.on("changed", (value) => seen.push({ node, ...plain(value) }));
    return item.statusCode.name;
  },
  async events({ node, fields, period }) {
    subscription ??= await session.createSubscription2({
      requestedPublishingInterval: period,
      requestedMaxKeepAliveCount: 20,
      requestedLifetimeCount: 100,
      publishingEnabled: true,
    });
    const item = ClientMonitoredItem.create(
      subscription,
      { nodeId: node, attributeId: AttributeIds.EventNotifier },
      { samplingInterval: 0, queueSize: 1000, discardOldest: true, filter: constructEventFilter(fields) },
      TimestampsToReturn.Both,
    );
    await new Promise((done) => item.once("initialized", done));
    const text = (value) => value?.text ?? (typeof value === "bigint" ? String(value) : Array.isArray(value) ? value[1] : value);
    item.on("changed", (values) => seen.push({ node, event: values.map((one) => text(one.value)) }));
    return "Good";
  },
  async seen() {
    return seen.splice(0);
  },
  async close() {
    await session?.close();
    await client?.disconnect();
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
