// Curves over the frames of a clip, drawn small.

/** The least and the largest value in each column of pixels: [low, high]. */
export function columns(values, stride, offset, [first, last], width) {
  const low = new Float32Array(width).fill(NaN), high = new Float32Array(width).fill(NaN);
  const frames = Math.max(last - first, 1);
  for (let frame = first; frame <= last; frame++) {
    const value = values[frame * stride + offset];
    if (Number.isNaN(value)) continue;
    const x = Math.min(width - 1, Math.floor(((frame - first) / frames) * (width - 1)));
    if (!(low[x] <= value)) low[x] = value;
    if (!(high[x] >= value)) high[x] = value;
  }
  return [low, high];
}

/** Draw a curve. `scale` leads from a value to y; with a `spread`, a band around it. */
export function curve(context, values, { stride = 1, offset = 0, range, width, scale, colour, spread = 0, line = 1.3 }) {
  const [low, high] = columns(values, stride, offset, range, width);
  const forward = [];
  for (let x = 0; x < width; x++) if (!Number.isNaN(low[x])) forward.push(x);
  if (!forward.length) return;
  if (spread) {
    context.fillStyle = colour;
    context.globalAlpha = 0.18;
    context.beginPath();
    for (const x of forward) context.lineTo(x, scale(Math.min(high[x] + spread, 1)));
    for (const x of forward.toReversed()) context.lineTo(x, scale(Math.max(low[x] - spread, 0)));
    context.fill();
    context.globalAlpha = 1;
  }
  context.strokeStyle = colour;
  context.lineWidth = line;
  context.lineJoin = "round";
  context.beginPath();
  const apart = width / Math.max(range[1] - range[0], 1) + 1.5; // of two frames
  for (const [i, x] of forward.entries()) {
    if (i && x - forward[i - 1] > apart) context.moveTo(x + 0.5, scale(high[x]));
    context.lineTo(x + 0.5, scale(high[x]));
    if (high[x] !== low[x]) context.lineTo(x + 0.5, scale(low[x]));
  }
  context.stroke();
}

/** The x of a frame, and the frame at an x, in a view of frames. */
export function axis([first, last], width) {
  const frames = Math.max(last - first, 1);
  return {
    x: (frame) => ((frame - first) / frames) * (width - 1),
    frame: (x) => first + (x / Math.max(width - 1, 1)) * frames,
  };
}
