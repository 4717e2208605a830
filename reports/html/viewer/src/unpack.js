// Reads the container that pack.py writes: deflated, in base64.

export async function inflate(base64) {
  if (typeof DecompressionStream === "undefined") {
    throw new Error("this browser cannot unpack the data of the view (no DecompressionStream)");
  }
  const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// {header, array(name)}: arrays of unsigned integers, put together from their planes of bytes.
export function unpack(data) {
  const length = new DataView(data.buffer, data.byteOffset).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(data.subarray(4, 4 + length)));
  const body = data.subarray(4 + length);
  const entries = new Map(header.arrays.map((entry) => [entry.name, entry]));
  function array(name) {
    const { at, n, width, delta } = entries.get(name);
    const out = width === 1 ? new Uint8Array(n) : width === 2 ? new Uint16Array(n) : new Uint32Array(n);
    for (let k = 0; k < width; k++) {
      const plane = body.subarray(at + k * n, at + (k + 1) * n);
      const shift = 8 * k;
      for (let i = 0; i < n; i++) out[i] |= plane[i] << shift;
    }
    if (delta) {
      const mask = width === 4 ? 0xffffffff : 2 ** (8 * width) - 1;
      for (let i = 1; i < n; i++) out[i] = ((out[i - 1] + out[i]) & mask) >>> 0;
    }
    return out;
  }
  return { header, array };
}

// Indices from codes: 0 is the next new one, k the one k - 1 before the newest.
export function indices(codes) {
  const out = new Uint32Array(codes.length);
  let next = 0;
  for (let i = 0; i < codes.length; i++) {
    out[i] = next - codes[i];
    if (codes[i] === 0) next++;
  }
  return out;
}

// Places of points in the box, as parts of its longest side and from its middle: what a GPU bears.
export function places(packed, prefix, bits) {
  const { header, array } = packed;
  const longest = Math.max(...header.size) || 1;
  const top = 2 ** bits - 1;
  const axes = ["x", "y", "z"].map((axis) => array(`${prefix}.${axis}`));
  const out = new Float32Array(3 * axes[0].length);
  for (let d = 0; d < 3; d++) {
    const side = header.size[d] / longest;
    for (let i = 0; i < axes[d].length; i++) out[3 * i + d] = (axes[d][i] / top - 0.5) * side;
  }
  return out;
}
