// What the client library of Foxglove makes of an agent. Arguments: address, subprotocol, operator's token, developer's token,
// name of the agent. Prints what it has seen as one line of JSON.
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");
const WebSocket = require("ws");

const [address, protocol, operator, developer] = process.argv.slice(2);

function open(token) {
  const socket = new WebSocket(`ws://${address}/?token=${token}`, [protocol]);
  const client = new FoxgloveClient({ ws: socket });
  const seen = { statuses: [], channels: new Map(), services: [] };
  client.on("error", (error) => { console.error(error); process.exit(3); });
  client.on("status", (status) => seen.statuses.push(status.message));
  client.on("advertise", (channels) => channels.forEach((channel) => seen.channels.set(channel.topic, channel)));
  client.on("advertiseServices", (services) => seen.services.push(...services));
  return { socket, client, seen };
}

const once = (client, name) => new Promise((resolve) => client.on(name, resolve));
const until = async (what, holds) => {
  for (let i = 0; i < 500; i++) {
    if (holds()) return;
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
  console.error(`${what}: not within 10 s`);
  process.exit(4);
};

// Whatever does not come is no reason to wait for ever.
setTimeout(() => { console.error("not done within a minute"); process.exit(5); }, 60000).unref();

async function main() {
  const { socket, client, seen } = open(operator);
  const info = await once(client, "serverInfo");
  await until("channels and services", () => seen.channels.has("/sensor/count") && seen.services.length === 3);
  const result = { protocol: socket.protocol, name: info.name, capabilities: info.capabilities };

  // Values, read by the libraries of others after the schemas that they were told.
  const values = {};
  const topics = new Map();
  for (const topic of ["/sensor/count", "/sensor/place", "/sensor/image", "/sensor/way"]) {
    const channel = seen.channels.get(topic);
    const reader = new MessageReader(parse(channel.schema, { ros2: true }));
    topics.set(client.subscribe(channel.id), { topic, reader, schema: channel.schemaName });
  }
  let sequence = [];
  client.on("message", (message) => {
    const { topic, reader, schema } = topics.get(message.subscriptionId);
    const value = reader.readMessage(message.data);
    if (topic === "/sensor/count") sequence.push(value.value);
    values[topic] = { schema, value };
  });
  await until("values", () => sequence.length > 5 && Object.keys(values).length === 4);
  result.rising = sequence.every((value, i) => i === 0 || value > sequence[i - 1]);
  const image = values["/sensor/image"];
  result.image = { schema: image.schema, width: image.value.width, encoding: image.value.encoding, bytes: image.value.data.length };
  const way = values["/sensor/way"];
  result.way = { schema: way.schema, points: way.value.poses.map(({ pose }) => [pose.position.x, pose.position.y, pose.orientation.w]) };
  result.place = { x: values["/sensor/place"].value.x, y: String(values["/sensor/place"].value.y) };
  result.schema = values["/sensor/count"].schema;

  // A goal, a message, and the wheel.
  const publish = (topic, schemaName, value) => {
    const id = client.advertise({ topic, encoding: "json", schemaName });
    client.sendMessage(id, new TextEncoder().encode(JSON.stringify(value)));
    return id;
  };
  publish("/driver/notes", "Speed", { value: 8 });
  publish("/driver/goal", "Place", { x: 2, y: 0 });
  const gone = publish("/wheel", "Speed", { value: -4 });
  let commands = [];
  const wheel = seen.channels.get("/wheel/command");
  topics.set(client.subscribe(wheel.id), { topic: "/wheel/command", reader: new MessageReader(parse(wheel.schema, { ros2: true })) });
  client.on("message", () => { const value = values["/wheel/command"]?.value.value; if (value !== undefined) commands.push(value); });
  await until("the wheel", () => commands.includes(-4));
  await until("the plan", () => commands.at(-1) === 2);
  client.unadvertise(gone);
  client.advertise({ topic: "/sensor/count", encoding: "json", schemaName: "Speed" });
  await until("a refusal", () => seen.statuses.some((text) => text.includes("written by its module")));

  // Parameters: an operator may look, a developer change.
  const looked = once(client, "parameterValues");
  client.getParameters([], "all");
  result.parameters = (await looked).parameters.map(({ name, value }) => [name, value]);
  client.setParameters([{ name: "/sensor/params/step", value: 3 }], "no");
  await until("a refusal", () => seen.statuses.some((text) => text.includes("developer")));
  const second = open(developer);
  await once(second.client, "serverInfo");
  const told = new Promise((resolve) => client.on("parameterValues", (event) => { if (event.parameters.some((p) => p.value === 2.5)) resolve(event); }));
  client.subscribeParameterUpdates(["/sensor/params/step"]);
  // Two connections wait for nobody: once this one is answered, the change of the other comes after what it watches.
  const watched = once(client, "parameterValues");
  client.getParameters(["/sensor/params/step"], "watched");
  await watched;
  second.client.setParameters([{ name: "/sensor/params/step", value: 2.5 }], "yes");
  result.told = (await told).parameters[0].name;

  const graph = once(client, "connectionGraphUpdate");
  client.subscribeConnectionGraph();
  const { publishedTopics, subscribedTopics } = await graph;
  result.publishers = publishedTopics.find(({ name }) => name === "/sensor/count").publisherIds;
  result.subscribers = subscribedTopics.find(({ name }) => name === "/sensor/count").subscriberIds;

  const stop = seen.services.find(({ name }) => name === "/stop");
  const answered = once(client, "serviceCallResponse");
  const request = new TextEncoder().encode(JSON.stringify({ reason: "by Foxglove" }));
  client.sendServiceCallRequest({ serviceId: stop.id, callId: 7, encoding: "json", data: new DataView(request.buffer) });
  const response = await answered;
  result.stopped = [response.callId, new TextDecoder().decode(response.data)];
  const refused = once(client, "serviceCallFailure");
  client.sendServiceCallRequest({ serviceId: 99, callId: 8, encoding: "json", data: new DataView(request.buffer) });
  result.refused = (await refused).callId;
  console.log(JSON.stringify(result));
  client.close();
  second.client.close();
}

main().catch((error) => { console.error(error); process.exit(2); });
