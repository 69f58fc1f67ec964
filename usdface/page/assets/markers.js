// Markers: points with a size on the screen, and their names.

import { BufferAttribute, BufferGeometry, Color, Points, ShaderMaterial } from "three";
import { row } from "usdface/data";

const VERTEX = `
  attribute vec3 tint;
  attribute float extent;
  uniform float density;
  varying vec3 colour;
  void main() {
    colour = tint;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
    gl_Position.z -= 0.004 * gl_Position.w;
    gl_PointSize = extent * density;
  }`;
const FRAGMENT = `
  varying vec3 colour;
  void main() {
    float away = length(gl_PointCoord - 0.5);
    if (away > 0.5) discard;
    gl_FragColor = vec4(away > 0.36 ? vec3(0.01) : colour, 1.0);
    #include <colorspace_fragment>
  }`;

/** Round points of one size on the screen; NaN hides one. */
export class Markers {
  constructor(count, colour, extent = 7) {
    this.positions = new Float32Array(3 * count);
    this.tints = new Float32Array(3 * count);
    this.extents = new Float32Array(count).fill(extent);
    this.geometry = new BufferGeometry();
    this.geometry.setAttribute("position", new BufferAttribute(this.positions, 3));
    this.geometry.setAttribute("tint", new BufferAttribute(this.tints, 3));
    this.geometry.setAttribute("extent", new BufferAttribute(this.extents, 1));
    const density = Math.min(globalThis.devicePixelRatio || 1, 2);
    this.points = new Points(
      this.geometry,
      new ShaderMaterial({
        vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms: { density: { value: density } },
      }),
    );
    this.points.frustumCulled = false;
    for (let i = 0; i < count; i++) this.tint(i, colour);
  }

  tint(index, colour) {
    new Color(colour).toArray(this.tints, 3 * index);
    this.geometry.attributes.tint.needsUpdate = true;
  }

  grow(index, extent) {
    this.extents[index] = extent;
    this.geometry.attributes.extent.needsUpdate = true;
  }

  /** Move to a frame of a table of positions. */
  move(table, frame) {
    this.place(row(table, frame));
  }

  /** Move to positions (3 M); what is NaN is hidden far away. */
  place(values) {
    for (let i = 0; i < this.positions.length; i++)
      this.positions[i] = Number.isNaN(values[i]) ? 1e6 : values[i];
    this.geometry.attributes.position.needsUpdate = true;
  }
}
