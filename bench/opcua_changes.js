// A client of OPC UA that follows one pin of many controllers and writes when it has seen each level: URL COUNT PIN FILE
const fs = require("node:fs");
const { AttributeIds, MessageSecurityMode, OPCUAClient, SecurityPolicy, TimestampsToReturn } = require("node-opcua-client");

const [url, count, pin, file] = process.argv.slice(2);

async function main() {
  const client = OPCUAClient.create({
    endpointMustExist: false,
    securityMode: MessageSecurityMode.None,
    securityPolicy: SecurityPolicy.None,
    connectionStrategy: { maxRetry: 0 },
  });
  await client.connect(url);
  const session = await client.createSession();
  const subscription = await session.createSubscription2({
    requestedPublishingInterval: 20,
    requestedMaxKeepAliveCount: 50,
    requestedLifetimeCount: 10000,
    publishingEnabled: true,
  });
  const seen = [];
  for (let first = 0; first < Number(count); first += 100) {
    const nodes = [];
    for (let number = first; number < Math.min(first + 100, Number(count)); number++)
      nodes.push({ nodeId: `ns=2;s=t${number}.pins.${pin}`, attributeId: AttributeIds.Value });
    const group = await subscription.monitorItems(nodes, { samplingInterval: 20, queueSize: 10, discardOldest: true }, TimestampsToReturn.Source);
    group.on("changed", (_, value) => seen.push(`${Date.now()} ${value.value.value}\n`));
  }
  seen.length = 0;
  fs.writeFileSync(`${file}.ready`, "");
  process.on("SIGTERM", () => {
    fs.writeFileSync(file, seen.join(""));
    process.exit(0);
  });
}

main();
