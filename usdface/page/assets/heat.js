// Colours of the skin: residuals of the markers spread over it, or the difference of two poses.

import { BufferAttribute, MeshStandardMaterial } from "three";
import { parted } from "usdface/character";
import { row } from "usdface/data";

const SKIN = [0.3, 0.31, 0.33];
// From small to large; colours in linear light.
const RESIDUAL = [SKIN, [0.75, 0.6, 0.08], [0.85, 0.16, 0.02], [0.75, 0.0, 0.12]];
const CHANGE = [SKIN, [0.05, 0.35, 0.65], [0.1, 0.75, 0.85], [0.9, 0.95, 0.95]];

/** The colour of a share from 0 to 1, as CSS. */
export function css(ramp, share) {
  const [r, g, b] = mixed(ramp, share).map((value) => Math.round(255 * value ** (1 / 2.2)));
  return `rgb(${r} ${g} ${b})`;
}

const RIBBON = [
  [0.018, 0.022, 0.028], [0.06, 0.055, 0.03], [0.45, 0.33, 0.04], [0.85, 0.3, 0.02], [0.85, 0.03, 0.06],
];

export const RAMPS = { residual: RESIDUAL, change: CHANGE, ribbon: RIBBON };

function mixed(ramp, share) {
  const at = Math.min(Math.max(share, 0), 1) * (ramp.length - 1);
  const low = Math.min(Math.floor(at), ramp.length - 2);
  return ramp[low].map((value, i) => value + (at - low) * (ramp[low + 1][i] - value));
}

/** The coloured skin of one mesh, in place of its materials. */
export class Heat {
  constructor(character, index) {
    const { points, source } = character.parts[index];
    this.source = source;
    this.character = character;
    this.index = index;
    this.colours = new Float32Array(points.length);
    const count = source ? source.length : points.length / 3;
    this.attribute = new BufferAttribute(source ? new Float32Array(3 * count) : this.colours, 3);
    const skin = new MeshStandardMaterial({ vertexColors: true, roughness: 0.65 });
    this.materials = character.materials.map(() => skin);
    this.first = new Float32Array(points.length);
    this.second = new Float32Array(points.length);
  }

  /** Put the coloured skin on figures, or take it off. */
  wear(figures, on) {
    for (const figure of figures) {
      const mesh = figure.meshes[this.index];
      mesh.geometry.setAttribute("color", this.attribute);
      mesh.material = on ? this.materials : this.character.materials;
    }
  }

  /** Colour by the residuals of a frame [mm], each spread to the vertices near its marker; return
   *  whether a marker is seen. */
  residual({ nearest, shares, residual_mm }, frame, most) {
    const own = row(residual_mm, frame), width = nearest.width;
    for (let vertex = 0; vertex < nearest.shape[0]; vertex++) {
      let value = 0;
      for (let k = 0; k < width; k++) {
        const residual = own[nearest.values[vertex * width + k]];
        if (!Number.isNaN(residual)) value += shares.values[vertex * width + k] * residual;
      }
      this.paint(vertex, RESIDUAL, value / most);
    }
    this.painted();
    return own.some((residual) => !Number.isNaN(residual));
  }

  /** Colour by the distance of vertices between two sets of weights; return the largest [mm]. */
  change(before, after, most) {
    this.character.displacements(this.index, before, this.first);
    this.character.displacements(this.index, after, this.second);
    let largest = 0;
    for (let vertex = 0; vertex < this.first.length / 3; vertex++) {
      let square = 0;
      for (let axis = 0; axis < 3; axis++)
        square += (this.second[3 * vertex + axis] - this.first[3 * vertex + axis]) ** 2;
      const away = 1000 * Math.sqrt(square);
      largest = Math.max(largest, away);
      this.paint(vertex, CHANGE, away / most);
    }
    this.painted();
    return largest;
  }

  painted() {
    if (this.source) parted(this.colours, this.source, 3, this.attribute.array);
    this.attribute.needsUpdate = true;
  }

  paint(vertex, ramp, share) {
    const colour = share > 0.001 ? mixed(ramp, share) : ramp[0];
    this.colours[3 * vertex] = colour[0];
    this.colours[3 * vertex + 1] = colour[1];
    this.colours[3 * vertex + 2] = colour[2];
  }
}
