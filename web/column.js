// Columns of numbers as docs/report-json.md describes them.

export function bytesOf(base64) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(base64);
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

// Values minus `origin`, NaN where there is none.
export function decoded(column, origin = 0) {
  const bytes = bytesOf(column.float32);
  const view = new DataView(bytes.buffer, bytes.byteOffset);
  const values = new Float64Array(bytes.length / 4);
  const shift = column.offset - origin;
  for (let i = 0; i < values.length; ++i) values[i] = view.getFloat32(4 * i, true) + shift;
  return values;
}

// The place of the last value that is not larger; values ascend.
export function indexBefore(values, value) {
  let low = 0;
  let high = values.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (values[middle] <= value) low = middle;
    else high = middle - 1;
  }
  return low;
}

export function extent(...columns) {
  let low = Infinity;
  let high = -Infinity;
  for (const column of columns) {
    for (const value of column) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return low <= high ? [low, high] : null;
}
