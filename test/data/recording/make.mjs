// SPDX-License-Identifier: BSD-3-Clause
// Made the .mcap files of this folder with another implementation of the format:
//   npm install @mcap/core lz4js; node make.mjs    (and the program zstd)
// and reads a file with it: node make.mjs FILE.mcap    prints its topics and what they hold
import { execFileSync } from "child_process";
import { McapIndexedReader, McapStreamReader, McapWriter } from "@mcap/core";
import fs from "fs";
import lz4 from "lz4js";

const definition = `std_msgs/Header header

string[] name
float64[] position
float64[] velocity
float64[] effort
${"=".repeat(80)}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
${"=".repeat(80)}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
`;

// CDR by the text of the specification: fields aligned to their size, counted from behind four bytes.
function cdr(i, little) {
  const bytes = Buffer.alloc(400);
  let place = 4;
  bytes[1] = little ? 1 : 0;
  const align = (to) => (place = 4 + Math.ceil((place - 4) / to) * to);
  const u32 = (v) => {
    align(4);
    little ? bytes.writeUInt32LE(v, place) : bytes.writeUInt32BE(v, place);
    place += 4;
  };
  const text = (v) => {
    u32(v.length + 1);
    place += bytes.write(v, place) + 1;
  };
  const numbers = (all) => {
    u32(all.length);
    for (const v of all) {
      align(8);
      little ? bytes.writeDoubleLE(v, place) : bytes.writeDoubleBE(v, place);
      place += 8;
    }
  };
  u32(1700000000);
  u32(i * 1000000);
  text("base");
  u32(2);
  text("elbow_motor");
  text("elbow_load");
  numbers([0.1 * i, 0.1 * i - 0.01]);
  numbers([]);
  numbers([Math.sin(i), NaN]);
  return bytes.subarray(0, place);
}

async function write(path, compression, little, useChunks) {
  const parts = [];
  let size = 0n;
  const writer = new McapWriter({
    writable: {
      position: () => size,
      write: async (b) => {
        parts.push(Buffer.from(b));
        size += BigInt(b.byteLength);
      },
    },
    chunkSize: 2000,
    useChunks,
    compressChunk: {
      lz4: (data) => ({ compression: "lz4", compressedData: Uint8Array.from(lz4.compress(data)) }),
      zstd: (data) => ({ compression: "zstd", compressedData: new Uint8Array(execFileSync("zstd", ["-c"], { input: data })) }),
    }[compression],
  });
  await writer.start({ profile: "ros2", library: "" });
  const schemaId = await writer.registerSchema({
    name: "sensor_msgs/msg/JointState",
    encoding: "ros2msg",
    data: new TextEncoder().encode(definition),
  });
  const channelId = await writer.registerChannel({
    schemaId,
    topic: "/joint_states",
    messageEncoding: "cdr",
    metadata: new Map([["offered_qos_profiles", ""]]),
  });
  for (let i = 0; i < 30; i++) {
    const time = 1700000000000000000n + BigInt(i) * 1000000n;
    await writer.addMessage({ channelId, sequence: i, logTime: time, publishTime: time, data: cdr(i, little) });
  }
  await writer.end();
  fs.writeFileSync(path, Buffer.concat(parts));
}

async function print(path) {
  const data = fs.readFileSync(path);
  const decompressHandlers = { zstd: (b) => execFileSync("zstd", ["-dc"], { input: b, maxBuffer: 1 << 28 }), lz4: (b) => lz4.decompress(b) };
  const reader = await McapIndexedReader.Initialize({
    readable: {
      size: async () => BigInt(data.length),
      read: async (offset, length) => data.subarray(Number(offset), Number(offset + length)),
    },
    decompressHandlers,
  });
  const counts = {};
  for await (const message of reader.readMessages()) {
    const channel = reader.channelsById.get(message.channelId);
    const schema = reader.schemasById.get(channel.schemaId);
    const key = `${channel.topic} ${schema.name} ${schema.encoding} ${channel.messageEncoding}`;
    counts[key] = (counts[key] ?? 0) + 1;
  }
  const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  stream.append(data);
  let messages = 0;
  for (let record; (record = stream.nextRecord()); ) if (record.type === "Message") messages++;
  console.log(JSON.stringify({ profile: reader.header.profile, counts, streamed: messages, done: stream.done(),
    stated: Number(reader.statistics.messageCount), chunks: reader.chunkIndexes.length }));
}

if (process.argv[2]) await print(process.argv[2]);
else
  for (const [name, compression, little, chunks] of [
    ["plain.mcap", "none", true, false],
    ["chunks.mcap", "none", true, true],
    ["lz4.mcap", "lz4", false, true],
    ["zstd.mcap", "zstd", true, true],
  ])
    await write(name, compression, little, chunks);
