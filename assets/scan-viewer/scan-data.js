// Decodes the binary data of a scan: a JSON header and arrays; see crates/export/src/scan_view/scan_data.rs.

/** Decodes a PNG without changing its values. */
function bitmapOf(bytes) {
  const unchanged = { premultiplyAlpha: "none", colorSpaceConversion: "none" };
  return createImageBitmap(new Blob([bytes], { type: "image/png" }), unchanged);
}

/** Returns the header, the arrays as typed arrays, and the textures as bitmaps. */
export async function decodeScan(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const part = (name, Kind) => {
    const { offset, bytes } = header.arrays[name];
    return new Kind(buffer, 4 + length + offset, bytes / Kind.BYTES_PER_ELEMENT);
  };
  const [print, masks] = await Promise.all([bitmapOf(part("print", Uint8Array)), bitmapOf(part("masks", Uint8Array))]);
  return {
    header,
    positions: part("positions", Float32Array),
    textureCoordinates: part("texture_coordinates", Float32Array),
    heights: part("heights", Float32Array),
    corners: part("corners", Uint32Array),
    print,
    masks,
  };
}

/** Returns the smallest box around positions as `{ low, high }`. */
export function boundsOf(positions) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < positions.length; i++) {
    const value = positions[i];
    if (value < low[i % 3]) low[i % 3] = value;
    if (value > high[i % 3]) high[i % 3] = value;
  }
  return { low, high };
}
