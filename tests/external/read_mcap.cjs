// Reads an MCAP file of `tricoil convert` with @mcap/core, which checks all CRCs, and compares it with the JSON lines of the recording.
//   node read_mcap.cjs MODULES FILE.mcap FILE.jsonl
const assert = require('assert');
const fs = require('fs');
const [, , modules, mcapPath, linesPath] = process.argv;
const {McapIndexedReader, McapStreamReader} = require(`${modules}/node_modules/@mcap/core`);

const bytes = new Uint8Array(fs.readFileSync(mcapPath));
const memory = data => ({
  size: async () => BigInt(data.length),
  read: async (offset, size) => data.slice(Number(offset), Number(offset + size)),
});
const lines = fs.readFileSync(linesPath, 'utf8').trim().split('\n').map(line => JSON.parse(line));

/// Every record in order; the reader checks the CRCs of chunks and of the data section.
function stream(data) {
  const reader = new McapStreamReader({validateCrcs: true});
  reader.append(data);
  const records = [];
  for (let record; (record = reader.nextRecord());) records.push(record);
  assert(reader.done());
  return records;
}

/// Messages by topic, through the indexes of the summary.
async function indexed(data) {
  const reader = await McapIndexedReader.Initialize({readable: memory(data)});
  const topics = {};
  for await (const message of reader.readMessages({validateCrcs: true})) {
    const channel = reader.channelsById.get(message.channelId);
    assert.equal(channel.messageEncoding, 'json');
    (topics[channel.topic] ??= []).push({...message, json: JSON.parse(Buffer.from(message.data).toString())});
  }
  return {reader, topics};
}

async function main() {
  const records = stream(bytes);
  const chunks = records.filter(record => record.type === 'Chunk' || record.type === 'MessageIndex').length;
  const messages = records.filter(record => record.type === 'Message');
  const {reader, topics} = await indexed(bytes);
  assert.deepEqual(Object.keys(topics).sort(), ['/sensor0/pose', '/sensor0/tracker']);
  const tracker = topics['/sensor0/tracker'];
  const poses = topics['/sensor0/pose'];
  assert.equal(tracker.length, lines.length);
  assert.equal(poses.length, lines.filter(line => line.valid).length);
  assert.equal(messages.length, tracker.length + poses.length);
  assert.equal(Number(reader.statistics.messageCount), messages.length);
  assert(reader.statistics.chunkCount > 1, 'one chunk does not test the index');
  tracker.forEach((message, n) => {
    assert.equal(message.logTime, BigInt(lines[n].time_us) * 1000n);
    assert.equal(message.sequence, lines[n].sequence);
    assert.equal(message.json.flags, lines[n].flags);
    assert.equal(message.json.flag_names, lines[n].flag_names);
    if (lines[n].position_m === null) assert.equal(message.json.position_m, null);  // no sensor
    else lines[n].position_m.forEach((x, i) => assert(Math.abs(message.json.position_m[i] - x) < 2e-7));
  });
  const valid = lines.filter(line => line.valid);
  poses.forEach((message, n) => {
    const {timestamp, frame_id, pose} = message.json;
    assert.equal(timestamp.sec * 1e6 + timestamp.nsec / 1e3, valid[n].time_us);
    assert.equal(frame_id, 'source');
    assert(Math.abs(pose.position.y - valid[n].position_m[1]) < 2e-7);
    assert(Math.abs(pose.orientation.w - valid[n].q_wxyz[0]) < 1e-6);
  });
  for (const schema of reader.schemasById.values()) {
    assert.equal(schema.encoding, 'jsonschema');
    const properties = Object.keys(JSON.parse(Buffer.from(schema.data).toString()).properties);
    const sample = schema.name === 'foxglove.PoseInFrame' ? poses[0].json : tracker[0].json;
    assert.deepEqual(properties.sort(), Object.keys(sample).sort(), schema.name);
  }
  // The reader notices damage.
  for (const at of [Math.floor(bytes.length / 3), bytes.length - 100]) {
    const damaged = bytes.slice();
    damaged[at] ^= 1;
    await assert.rejects(async () => { stream(damaged); await indexed(damaged); }, undefined, `byte ${at}`);
  }
  console.log(`${chunks} chunks and indexes, ${messages.length} messages equal the recording; CRCs are right`);
}

main().catch(error => { console.error(error); process.exit(1); });
