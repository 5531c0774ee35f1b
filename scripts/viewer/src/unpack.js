// Format "motion 1" of artde_gym/motion/packing.py: numbers (samples, columns), row by row.
export async function unpack({ samples, start, units, data }) {
  const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const raw = new Uint8Array(await new Response(stream).arrayBuffer());
  const size = units.length, half = samples * size, out = new Float64Array(half);
  for (let c = 0; c < size; c++) {
    let value = start[c];
    for (let i = 0; i < samples; i++) {
      const z = raw[c * samples + i] | (raw[half + c * samples + i] << 8);
      value += (z >> 1) ^ -(z & 1);
      out[i * size + c] = value * units[c];
    }
  }
  return out;
}
