// Opens the Foxglove WebSocket with Foxglove's own client and checks the messages.
// node foxglove.mjs URL TOPIC...: waits until each topic has sent three messages that match Foxglove's
// schemas.
import wsProtocol from "@foxglove/ws-protocol";
import * as wellKnown from "@foxglove/schemas/jsonschema.js";
import Ajv from "ajv";
import WebSocket from "ws";

const { FoxgloveClient } = wsProtocol;

const [url, ...topics] = process.argv.slice(2);
const wanted = 3;

let failed = 0;
function check(what, holds, detail = "") {
  console.log(`${holds ? "ok " : "NOT"} ${what}${holds ? "" : ": " + detail}`);
  if (!holds) failed += 1;
}

function opened(socket) {
  return new Promise((resolve) => {
    socket.on("open", () => resolve(true));
    socket.on("error", () => resolve(false));
    socket.on("unexpected-response", () => resolve(false));
  });
}

function publishedSchema(name) {
  return name.startsWith("foxglove.") ? wellKnown[name.slice(9)] : { type: "object" };
}

/// Subscribes to all offered channels until all topics have arrived.
async function look(protocol) {
  const socket = new WebSocket(url, [protocol], { origin: "https://app.foxglove.dev" });
  const client = new FoxgloveClient({ ws: socket });
  const ajv = new Ajv({ strict: false, strictNumbers: false });
  const channels = new Map(), counts = new Map();
  let info, time, invalid = "";
  const done = new Promise((resolve) => {
    client.on("serverInfo", (message) => (info = message));
    client.on("time", ({ timestamp }) => (time = timestamp));
    client.on("advertise", (offered) => {
      for (const channel of offered) {
        const valid = [ajv.compile(JSON.parse(channel.schema)), ajv.compile(publishedSchema(channel.schemaName))];
        channels.set(client.subscribe(channel.id), { ...channel, valid });
      }
    });
    client.on("message", ({ subscriptionId, timestamp, data }) => {
      const channel = channels.get(subscriptionId);
      const content = JSON.parse(new TextDecoder().decode(data));
      if (timestamp <= 0n || !channel.valid.every((valid) => valid(content))) invalid ||= channel.topic;
      counts.set(channel.topic, (counts.get(channel.topic) ?? 0) + 1);
      if (topics.every((topic) => (counts.get(topic) ?? 0) >= (topic === "/building" ? 1 : wanted))) resolve();
    });
  });
  await done;
  check(`${protocol} is spoken`, socket.protocol === protocol, socket.protocol);
  check("the server says who it is", info?.name === "Parhelion" && Array.isArray(info.capabilities));
  check("and what time it is", info.capabilities.includes("time") && Math.abs(Number(time) / 1e6 - Date.now()) < 60_000, time);
  check("each topic comes, and as its schemas say", invalid === "", invalid);
  check("schemas are JSON Schema", [...channels.values()].every((c) => c.schemaEncoding === "jsonschema" && c.encoding === "json"));
  const [subscription] = [...channels].find(([, channel]) => channel.topic === "/scene");
  client.unsubscribe(subscription);
  const complaints = new Promise((resolve) => client.on("status", resolve));
  socket.send("no JSON");
  check("nonsense is answered", (await complaints).level === 2);
  client.close();
}

await look("foxglove.sdk.v1");
await look("foxglove.websocket.v1");
check("another subprotocol is refused", !(await opened(new WebSocket(url, ["something.else"]))));
check("none is refused", !(await opened(new WebSocket(url))));
process.exit(failed === 0 ? 0 : 1); // a refused connection may stay open
