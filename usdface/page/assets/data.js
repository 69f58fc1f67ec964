// The data of the page: JSON, and a compressed block of the arrays that it names.
// usdface/page/packed_data.py writes both.

const KINDS = { u8: Uint8Array, u16: Uint16Array, u32: Uint32Array, f32: Float32Array };

/** Read the data of the page; arrays become tables { values, shape, width }. */
export async function readData() {
  const tree = JSON.parse(document.getElementById("data").textContent);
  const packed = bytesOf(document.getElementById("block").textContent);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return revived(tree, await new Response(stream).arrayBuffer());
}

/** One row of a table. */
export function row(table, index) {
  return table.values.subarray(index * table.width, (index + 1) * table.width);
}

function bytesOf(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = letters.charCodeAt(i);
  return bytes;
}

function revived(value, buffer) {
  if (Array.isArray(value)) return value.map((each) => revived(each, buffer));
  if (value === null || typeof value !== "object") return value;
  if ("array" in value) return table(value.array, buffer);
  const entries = Object.entries(value).map(([name, each]) => [name, revived(each, buffer)]);
  return Object.fromEntries(entries);
}

function table({ at, type, shape, low, step }, buffer) {
  const size = shape.reduce((product, count) => product * count, 1);
  const width = shape[0] ? size / shape[0] : 1;
  const values = new KINDS[type](buffer, at, size).slice();
  if (type === "f32") return { values, shape, width };
  // Rows hold the difference to the row before; the type makes the sums modulo its size.
  for (let i = width; i < size; i++) values[i] += values[i - width];
  if (step === undefined) return { values, shape, width };
  const missing = type === "u8" ? 255 : 65535;
  const numbers = new Float32Array(size);
  for (let i = 0; i < size; i++) numbers[i] = values[i] === missing ? NaN : low + step * values[i];
  return { values: numbers, shape, width };
}
