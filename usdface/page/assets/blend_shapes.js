// From the weights of blend shapes to those of morph targets: inbetweens and combination shapes.

/** Weights of all shapes in which combination shapes follow their parents. */
export function combined(combinations, weights) {
  const result = Float32Array.from(weights);
  for (const { shape, of, least } of combinations) {
    const own = of.map((parent) => result[parent]);
    result[shape] = least ? Math.min(...own) : own.reduce((product, weight) => product * weight, 1);
  }
  return result;
}

/**
 * Write the weights of a shape's targets: its inbetweens and itself, at rising `knots` without 0.
 *
 * The path goes straight from knot to knot, and on beyond the outer ones (UsdSkel).
 */
export function spread(knots, weight, out, first) {
  out.fill(0, first, first + knots.length);
  if (knots.length === 1) {
    out[first] = weight / knots[0];
    return;
  }
  const path = [...knots, 0].sort((a, b) => a - b);
  const above = path.findIndex((knot) => knot >= weight);
  const right = Math.min(Math.max(above < 0 ? path.length - 1 : above, 1), path.length - 1);
  const part = (weight - path[right - 1]) / (path[right] - path[right - 1]);
  for (const [knot, share] of [[path[right - 1], 1 - part], [path[right], part]])
    if (knot !== 0) out[first + knots.indexOf(knot)] += share;
}
