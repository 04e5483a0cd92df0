// Reads an MCAP file with Foxglove's own reader and checks each message against Foxglove's own schemas.
// node mcap.mjs FILE SUMMARY.json: writes the content to SUMMARY for the calling test.
import { readFileSync, writeFileSync } from "node:fs";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";
import { crc32 } from "@foxglove/crc";
import * as wellKnown from "@foxglove/schemas/jsonschema.js";
import Ajv from "ajv";

const [path, summaryPath] = process.argv.slice(2);
const bytes = readFileSync(path);
const decompressHandlers = await loadDecompressHandlers();

let failed = 0;
function check(what, holds, detail = "") {
  console.log(`${holds ? "ok " : "NOT"} ${what}${holds ? "" : ": " + detail}`);
  if (!holds) failed += 1;
}

function readThrough(content) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  reader.append(content);
  const records = [];
  for (let record; (record = reader.nextRecord()); ) records.push(record);
  check("the whole file is read from start to end", reader.done());
  return records;
}

const indexed = await McapIndexedReader.Initialize({
  readable: {
    size: async () => BigInt(bytes.length),
    read: async (offset, length) => bytes.subarray(Number(offset), Number(offset + length)),
  },
  decompressHandlers,
});
const byIndex = [];
for await (const message of indexed.readMessages({ validateCrcs: true })) byIndex.push(message);
const records = readThrough(bytes);
const linear = records.filter((record) => record.type === "Message");

check("the index finds as many messages as there are", byIndex.length === linear.length, `${byIndex.length}, ${linear.length}`);
check("the statistics say so, too", indexed.statistics.messageCount === BigInt(linear.length));
const counts = new Map();
for (const message of linear) counts.set(message.channelId, (counts.get(message.channelId) ?? 0n) + 1n);
check("and of each channel", [...indexed.statistics.channelMessageCounts].every(([id, n]) => counts.get(id) === n));
check("the index goes by log time", byIndex.every((m, i) => i === 0 || byIndex[i - 1].logTime <= m.logTime));

const key = (m) => `${m.channelId} ${m.sequence} ${m.logTime} ${m.publishTime} ${crc32(m.data)}`;
const start = indexed.statistics.messageStartTime, length = indexed.statistics.messageEndTime - start;
for (const [from, to] of [[0n, 25n], [30n, 31n], [90n, 100n]]) {
  const startTime = start + (length * from) / 100n, endTime = start + (length * to) / 100n;
  const found = [];
  for await (const message of indexed.readMessages({ startTime, endTime })) found.push(key(message));
  const expected = linear.filter((m) => m.logTime >= startTime && m.logTime <= endTime).map(key);
  check(`${from} to ${to} % by the index is what lies there`, found.sort().join() === expected.sort().join());
}

const footer = records.find((record) => record.type === "Footer");
const dataEnd = records.find((record) => record.type === "DataEnd");
const dataEndAt = Number(footer.summaryStart) - 13; // opcode, length, CRC
check("the data's CRC", dataEnd.dataSectionCrc !== 0 && dataEnd.dataSectionCrc === crc32(bytes.subarray(0, dataEndAt)));
const summaryEnd = bytes.length - 8 - 4;
check("the summary's CRC", footer.summaryCrc === crc32(bytes.subarray(Number(footer.summaryStart), summaryEnd)));

const chunk = indexed.chunkIndexes[0];
const damaged = Uint8Array.from(bytes);
damaged[Number(chunk.chunkStartOffset) + Number(chunk.chunkLength) - 100] ^= 1;
let noticed = false;
try {
  readThrough(damaged);
} catch {
  noticed = true;
}
check("a flipped bit in a chunk is noticed", noticed);

// 1e999 in JSON is an infinity: no point there.
const ajv = new Ajv({ strict: false, strictNumbers: false });
const validators = new Map();
const summary = {};
const text = new TextDecoder("utf-8", { fatal: true });
let invalid = 0;
for (const message of linear) {
  const channel = indexed.channelsById.get(message.channelId);
  const schema = indexed.schemasById.get(channel.schemaId);
  const topic = (summary[channel.topic] ??= { encoding: channel.messageEncoding, schema: schema?.name ?? "", count: 0, bytes: 0 });
  topic.count += 1;
  topic.bytes += message.data.length;
  if (channel.messageEncoding !== "json") {
    topic.type = channel.metadata.get("type");
    continue;
  }
  if (!validators.has(schema.name)) {
    const own = JSON.parse(text.decode(schema.data));
    const published = schema.name.startsWith("foxglove.") ? wellKnown[schema.name.slice(9)] : own;
    check(`${schema.name} is a schema that is known, by its encoding`, published !== undefined && schema.encoding === "jsonschema");
    validators.set(schema.name, [ajv.compile(own), ajv.compile(published)]);
  }
  const content = JSON.parse(text.decode(message.data));
  topic.first ??= content;
  topic.last = content;
  topic.stamps ??= [message.logTime.toString(), message.publishTime.toString()];
  for (const valid of validators.get(schema.name)) {
    if (valid(content)) continue;
    if (invalid++ < 5) console.log(`NOT ${channel.topic}: ${ajv.errorsText(valid.errors)}`);
  }
}
check("each message is as its schema and Foxglove's say", invalid === 0, `${invalid} are not`);
writeFileSync(summaryPath, JSON.stringify(summary));
process.exitCode = failed === 0 ? 0 : 1;
