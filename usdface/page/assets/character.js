// The character: meshes with blend shapes, materials, joints. Copies of it share all but what moves.
//
// Blend shapes are added here, not by the graphics card: few vertices move at a time, so that this takes
// a millisecond, needs no textures of all targets, and has no limit to the number of shapes.

import {
  Bone, Box3, BufferAttribute, BufferGeometry, ClampToEdgeWrapping, Color, DoubleSide, FrontSide,
  Group, Matrix4, Mesh, MeshStandardMaterial, MirroredRepeatWrapping, RepeatWrapping, SRGBColorSpace,
  Skeleton, SkinnedMesh, TextureLoader, Vector3,
} from "three";
import { row } from "usdface/data";
import { spread } from "usdface/blend_shapes";

const CLAY = [0.62, 0.5, 0.44];

/** The geometry of a character, for any number of copies. */
export class Character {
  constructor(data, drawn = () => {}) {
    this.data = data;
    this.shapes = data.shapes;
    this.materials = data.materials.map((each) => material(each, drawn));
    this.parts = data.meshes.map((mesh) => part(mesh));
  }

  /** A copy that can be posed on its own. */
  copy() {
    return new Figure(this);
  }

  /** The box of the face as bound, with what is close around it. */
  faceBox() {
    const moved = new Box3(), face = new Box3(), at = new Vector3();
    const each = (call) => {
      for (const part of this.parts)
        for (let vertex = 0; vertex < part.moved.length; vertex++)
          call(at.fromArray(part.points, 3 * vertex), part.moved[vertex]);
    };
    each((point, moves) => moves && moved.expandByPoint(point));
    if (moved.isEmpty()) each((point) => moved.expandByPoint(point));
    // Ears and hair, not the body: most of what the box gains is above the face.
    const size = moved.getSize(new Vector3()), near = moved.clone();
    near.min.addScaledVector(size, -0.15);
    near.max.add(new Vector3(0.15 * size.x, 0.45 * size.y, 0.15 * size.z));
    each((point) => near.containsPoint(point) && face.expandByPoint(point));
    return face;
  }

  /** The joint that most of the face hangs on; -1 without one. */
  carrier() {
    const shares = new Map();
    this.data.meshes.forEach(({ skin }, index) => {
      if (!skin) return;
      const { moved } = this.parts[index], width = skin.joints.width;
      for (let i = 0; i < skin.joints.values.length; i++) {
        const joint = skin.joints.values[i], weight = skin.weights.values[i];
        if (moved[Math.floor(i / width)]) shares.set(joint, (shares.get(joint) ?? 0) + weight);
      }
    });
    return [...shares].reduce((best, each) => (each[1] > best[1] ? each : best), [-1, 0])[0];
  }

  /** Displacements of a mesh's vertices by weights of all shapes, written to `out` (3 V). */
  displacements(index, weights, out) {
    const { targets, shapes } = this.parts[index];
    const influences = this.influences(index, weights);
    out.fill(0);
    for (const { knots, shape, first } of shapes)
      for (let k = 0; k < knots.length; k++)
        if (influences[first + k]) added(targets[first + k], influences[first + k], out);
    return out;
  }

  /** Weights of the morph targets of a mesh. */
  influences(index, weights) {
    const { shapes, targets } = this.parts[index];
    const out = new Float32Array(targets.length);
    for (const { shape, knots, first } of shapes) spread(knots, weights[shape], out, first);
    return out;
  }
}

/** One copy of a character. */
export class Figure {
  constructor(character) {
    this.character = character;
    this.group = new Group();
    this.bones = bones(character.data.joints);
    this.skeleton = skeleton(character.data.joints, this.bones);
    if (this.bones.length) this.group.add(...this.bones.filter((bone) => !bone.parent));
    this.meshes = character.parts.map((own) => {
      const skinned = own.skinned && this.skeleton;
      const geometry = own.targets.length ? movable(own.geometry) : own.geometry;
      const mesh = new (skinned ? SkinnedMesh : Mesh)(geometry, character.materials);
      mesh.frustumCulled = false;
      mesh.name = own.name;
      if (skinned) mesh.bind(this.skeleton, new Matrix4());
      this.group.add(mesh);
      return mesh;
    });
  }

  /** Give all blend shapes a weight; a figure that is not shown moves once it is. */
  pose(weights) {
    this.meshes.forEach((mesh, index) => {
      const own = this.character.parts[index];
      if (!own.targets.length) return;
      const influences = this.character.influences(index, weights), before = mesh.userData.morphed;
      mesh.morphTargetInfluences = influences;
      if (!this.group.parent || (before && influences.every((share, i) => share === before[i]))) return;
      mesh.userData.morphed = influences;
      const { position, normal } = mesh.geometry.attributes;
      morphed(own, influences, "points", (target) => target, position);
      morphed(own, influences, "normals", (target) => turned(own, target), normal);
    });
  }

  /** Bring the joints to a frame of their motion. */
  move(motion, frame) {
    if (!motion) return;
    const moves = row(motion.translations, frame), turns = row(motion.rotations, frame);
    const sizes = row(motion.scales, frame);
    motion.joints.forEach((joint, i) => {
      const bone = this.bones[joint];
      bone.position.fromArray(moves, 3 * i);
      bone.quaternion.fromArray(turns, 4 * i).normalize();
      bone.scale.fromArray(sizes, 3 * i);
    });
  }

  /** The matrix that a joint moves its skin by; the identity without one. */
  carried(joint) {
    if (joint < 0 || !this.skeleton) return new Matrix4();
    this.group.updateMatrixWorld(true);
    const inverse = new Matrix4().copy(this.group.matrixWorld).invert();
    return inverse.multiply(this.bones[joint].matrixWorld).multiply(this.skeleton.boneInverses[joint]);
  }
}

const WRAPS = { repeat: RepeatWrapping, mirror: MirroredRepeatWrapping, clamp: ClampToEdgeWrapping };

/** `drawn` is called once the image of a material has been decoded. */
function material({ colour, opacity, metallic, roughness, two_sided, name, image, wrap, alpha, cutoff }, drawn) {
  const made = new MeshStandardMaterial({
    color: new Color().setRGB(...(name === "" ? CLAY : colour)),
    opacity, transparent: opacity < 1 || alpha === "blend", metalness: metallic,
    alphaTest: alpha === "mask" ? cutoff : 0,
    roughness: Math.max(roughness, 0.3), side: two_sided ? DoubleSide : FrontSide,
  });
  if (image) {
    made.map = new TextureLoader().load(image, drawn);
    made.map.colorSpace = SRGBColorSpace;
    [made.map.wrapS, made.map.wrapT] = wrap.map((each) => WRAPS[each]);
  }
  return made;
}

function part(data) {
  const points = data.points.values, triangles = data.triangles.values;
  // Vertices of the geometry: those of the mesh, or more where texture coordinates part them.
  const texture = data.texture, source = texture?.source.values;
  const spreadOut = (values, width) => (source ? parted(values, source, width) : values);
  const geometry = new BufferGeometry();
  const count = source ? source.length : points.length / 3;
  const index = count < 65536 ? Uint16Array : Uint32Array;
  geometry.setIndex(new BufferAttribute(index.from(texture ? texture.triangles.values : triangles), 1));
  geometry.setAttribute("position", new BufferAttribute(spreadOut(points, 3), 3));
  const normals = normalsOf(points, triangles);
  geometry.setAttribute("normal", new BufferAttribute(spreadOut(normals, 3), 3));
  if (texture) geometry.setAttribute("uv", new BufferAttribute(texture.coordinates.values, 2));
  for (const group of data.groups) geometry.addGroup(group.start, group.count, group.material);
  const targets = [], shapes = [], moved = new Uint8Array(points.length / 3);
  for (const { shape, weights, vertices, offsets } of data.shapes) {
    shapes.push({ shape, knots: weights, first: targets.length });
    for (const table of offsets) targets.push({ vertices: vertices.values, offsets: table.values });
    for (const vertex of vertices.values) moved[vertex] = 1;
  }
  const skin = data.skin;
  if (skin) {
    const joints = spreadOut(four(skin.joints, Uint16Array), 4);
    geometry.setAttribute("skinIndex", new BufferAttribute(joints, 4));
    geometry.setAttribute("skinWeight", new BufferAttribute(spreadOut(four(skin.weights, Float32Array), 4), 4));
  }
  const posed = new Float32Array(points.length);
  return { name: data.name, points, normals, triangles, geometry, targets, shapes, moved, source, posed, skinned: !!skin };
}

/** Values of the vertices that `source` names, `width` of each. */
export function parted(values, source, width, out = new values.constructor(width * source.length)) {
  for (let i = 0; i < source.length; i++)
    for (let k = 0; k < width; k++) out[width * i + k] = values[width * source[i] + k];
  return out;
}

/** A geometry of its own points and normals; all else is shared. */
function movable(geometry) {
  const own = new BufferGeometry();
  own.setIndex(geometry.index);
  for (const [name, attribute] of Object.entries(geometry.attributes))
    own.setAttribute(name, name === "position" || name === "normal" ? attribute.clone() : attribute);
  for (const group of geometry.groups) own.addGroup(group.start, group.count, group.materialIndex);
  return own;
}

/** Add a share of a target to the values of its vertices. */
function added({ vertices, offsets }, share, out) {
  for (let i = 0; i < vertices.length; i++) {
    const at = 3 * vertices[i];
    out[at] += share * offsets[3 * i];
    out[at + 1] += share * offsets[3 * i + 1];
    out[at + 2] += share * offsets[3 * i + 2];
  }
}

/** Write the points or the normals of a part at some influences to an attribute. */
function morphed(own, influences, kind, target, attribute) {
  const out = own.source ? own.posed : attribute.array;
  out.set(own[kind]);
  influences.forEach((share, i) => share && added(target(own.targets[i]), share, out));
  if (own.source) parted(out, own.source, 3, attribute.array);
  attribute.needsUpdate = true;
}

/** The change of the normals by a target, computed when it is first seen. */
function turned(own, target) {
  if (!target.turned) {
    own.around ??= facesAround(own.triangles, own.points.length / 3);
    const moving = own.posed;
    moving.set(own.points);
    added(target, 1, moving);
    target.turned = turns(moving, own, target.vertices);
  }
  return target.turned;
}

/** The triangles around each vertex, as lists one after the other. */
function facesAround(triangles, count) {
  const seen = new Uint32Array(count); // the last target that touched each vertex
  const starts = new Uint32Array(count + 1);
  for (const vertex of triangles) starts[vertex + 1]++;
  for (let i = 0; i < count; i++) starts[i + 1] += starts[i];
  const next = starts.slice(), faces = new Uint32Array(triangles.length);
  for (let corner = 0; corner < triangles.length; corner++)
    faces[next[triangles[corner]]++] = Math.floor(corner / 3);
  return { starts, faces, seen, round: 0 };
}

/** By how much the normals turn when some vertices have moved; only what they touch is computed. */
function turns(posed, { normals, triangles, around }, vertices) {
  const { starts, faces, seen } = around, round = ++around.round;
  const touched = [], offsets = [], sum = new Float32Array(3);
  for (const moved of vertices)
    for (let i = starts[moved]; i < starts[moved + 1]; i++)
      for (let corner = 0; corner < 3; corner++) {
        const vertex = triangles[3 * faces[i] + corner];
        if (seen[vertex] === round) continue;
        seen[vertex] = round;
        sum.fill(0);
        for (let k = starts[vertex]; k < starts[vertex + 1]; k++) addNormal(posed, triangles, faces[k], sum, 0);
        const length = Math.sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]) || 1;
        touched.push(vertex);
        for (let axis = 0; axis < 3; axis++) offsets.push(sum[axis] / length - normals[3 * vertex + axis]);
      }
  return { vertices: Uint32Array.from(touched), offsets: Float32Array.from(offsets) };
}

function addNormal(points, triangles, face, out, at) {
  const a = 3 * triangles[3 * face], b = 3 * triangles[3 * face + 1], c = 3 * triangles[3 * face + 2];
  const x1 = points[b] - points[a], y1 = points[b + 1] - points[a + 1], z1 = points[b + 2] - points[a + 2];
  const x2 = points[c] - points[a], y2 = points[c + 1] - points[a + 1], z2 = points[c + 2] - points[a + 2];
  out[at] += y1 * z2 - z1 * y2;
  out[at + 1] += z1 * x2 - x1 * z2;
  out[at + 2] += x1 * y2 - y1 * x2;
}

function normalsOf(points, triangles) {
  const normals = new Float32Array(points.length);
  for (let face = 0; face < triangles.length / 3; face++)
    for (let corner = 0; corner < 3; corner++)
      addNormal(points, triangles, face, normals, 3 * triangles[3 * face + corner]);
  for (let i = 0; i < normals.length; i += 3) {
    const length = Math.hypot(normals[i], normals[i + 1], normals[i + 2]) || 1;
    for (let axis = 0; axis < 3; axis++) normals[i + axis] /= length;
  }
  return normals;
}

function four(table, kind) {
  const count = table.shape[0], own = table.width;
  const out = new kind(4 * count);
  for (let i = 0; i < count; i++)
    for (let k = 0; k < Math.min(4, own); k++) out[4 * i + k] = table.values[own * i + k];
  return out;
}

function bones(joints) {
  if (!joints) return [];
  const made = joints.parents.map((_, i) => {
    const bone = new Bone();
    new Matrix4().fromArray(joints.rest, 16 * i).decompose(bone.position, bone.quaternion, bone.scale);
    return bone;
  });
  joints.parents.forEach((parent, i) => parent >= 0 && made[parent].add(made[i]));
  return made;
}

function skeleton(joints, made) {
  if (!joints || !made.length) return null;
  const inverses = made.map((_, i) => new Matrix4().fromArray(joints.bind, 16 * i).invert());
  return new Skeleton(made, inverses);
}

