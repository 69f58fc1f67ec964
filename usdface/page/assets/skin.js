// The bare surface of a face, for the pointer to meet; it is not drawn.

import { BufferAttribute, BufferGeometry, Mesh, MeshBasicMaterial, Raycaster, Vector2, Vector3 } from "three";

const AWAY = -0.2; // cosine to the camera below which skin is on the far side of the head

export class Skin {
  /** `part` is a part of a `Character`. */
  constructor(part) {
    const geometry = new BufferGeometry();
    geometry.setIndex(new BufferAttribute(Uint32Array.from(part.triangles), 1));
    geometry.setAttribute("position", new BufferAttribute(part.points, 3));
    geometry.computeVertexNormals();
    this.mesh = new Mesh(geometry, new MeshBasicMaterial({ visible: false }));
    this.points = part.points;
    this.normals = geometry.attributes.normal.array;
    this.outward = outward(geometry) ? 1 : -1;
    this.ray = new Raycaster();
  }

  /** The vertex under a place of the canvas, each from -1 to 1; -1 off the skin. */
  vertexAt({ x, y }, camera) {
    this.ray.setFromCamera(new Vector2(x, y), camera);
    const [hit] = this.ray.intersectObject(this.mesh);
    if (!hit) return -1;
    const at = this.mesh.worldToLocal(hit.point), corner = new Vector3();
    let best = -1, least = Infinity;
    for (const vertex of [hit.face.a, hit.face.b, hit.face.c]) {
      const away = corner.fromArray(this.points, 3 * vertex).distanceTo(at);
      if (away < least) [best, least] = [vertex, away];
    }
    return best;
  }

  /** Whether a vertex is on the far side of the head, for a camera at `from` in the skin's space. */
  turnedAway(vertex, from) {
    const towards = new Vector3().fromArray(this.points, 3 * vertex).sub(from).negate().normalize();
    return this.outward * new Vector3().fromArray(this.normals, 3 * vertex).dot(towards) < AWAY;
  }
}

/** Whether the normals lead out of the surface: the winding of a mesh may be either. */
function outward(geometry) {
  geometry.computeBoundingBox();
  const { position, normal } = geometry.attributes, centre = geometry.boundingBox.getCenter(new Vector3());
  let sum = 0;
  for (let i = 0; i < position.count; i++)
    sum += new Vector3().fromBufferAttribute(position, i).sub(centre).dot(new Vector3().fromBufferAttribute(normal, i));
  return sum >= 0;
}
