// The stage: renderer, camera, light, and the columns that characters and markers stand in.

import {
  AmbientLight, DirectionalLight, Group, HemisphereLight, NeutralToneMapping, OrbitControls,
  PerspectiveCamera, Scene, Vector3, WebGLRenderer,
} from "three";
import { element } from "usdface/dom";

const ANGLE = 9; // narrow, so that all columns are seen from the front
const NEAR = 12; // pixels within which a pointer holds a marker
const MARGIN = 1.16; // of the face's size
const APART = 1.3; // columns, in widths of the face

export class Stage {
  constructor(place, box) {
    this.place = place;
    this.centre = box.getCenter(new Vector3());
    this.size = box.getSize(new Vector3());
    // Smooth edges cost a renderer in software half of its frames.
    this.renderer = new WebGLRenderer({ antialias: !inSoftware() });
    this.renderer.toneMapping = NeutralToneMapping;
    this.renderer.toneMappingExposure = 1.05;
    this.renderer.setClearColor(0x1b1e24);
    this.renderer.setPixelRatio(Math.min(globalThis.devicePixelRatio || 1, 2));
    this.renderer.domElement.id = "canvas";
    place.append(this.renderer.domElement);
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(ANGLE, 1, 0.01, 100);
    this.scene.add(this.camera, ...this.lights());
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.enableDamping = false;
    this.controls.addEventListener("change", () => {
      this.turned = true;
      this.ask();
    });
    this.columns = [];
    this.before = [];
    this.frames = 0;
    const turn = (text, title, around) =>
      element("button", { type: "button", text, title, on: { click: () => this.fit(around) } });
    place.append(
      element("span", { class: "views set" }, [
        turn("front", "look from the front (f)", 0), turn("¾", "three quarters (g)", 0.7), turn("side", "from the side", Math.PI / 2),
      ]),
    );
    new ResizeObserver(() => this.resize()).observe(place);
    this.resize();
  }

  lights() {
    const key = new DirectionalLight(0xfff2e6, 2.3), fill = new DirectionalLight(0xdfe8ff, 0.9);
    const rim = new DirectionalLight(0xbfd4ff, 1.6);
    key.position.set(-0.7, 0.8, 1.2);
    fill.position.set(1.2, 0.1, 0.8);
    rim.position.set(0.6, 0.9, -1.2);
    // Key and fill come along with the camera, so that the face is lit from wherever it is seen.
    const along = new Group();
    along.add(key, key.target, fill, fill.target);
    this.camera.add(along);
    return [new HemisphereLight(0xffffff, 0x55504a, 0.9), new AmbientLight(0xffffff, 0.15), rim];
  }

  /** Show objects in columns from left to right: [{ group, label }]. */
  show(columns) {
    for (const { group, tag } of this.columns) {
      this.scene.remove(group);
      tag.remove();
    }
    const width = APART * Math.max(this.size.x, 0.6 * this.size.y);
    this.columns = columns.map(({ group, label }, i) => {
      this.scene.add(group);
      const tag = element("span", { class: "tag", text: label });
      this.place.append(tag);
      return { group, tag, away: (i - (columns.length - 1) / 2) * width };
    });
    this.breadth = this.size.x + (columns.length - 1) * width;
    if (this.fittedFor !== columns.length) this.fit();
    this.fittedFor = columns.length;
    this.ask();
  }

  /** Look at another place from now on. */
  look(box) {
    box.getCenter(this.centre);
    box.getSize(this.size);
    this.fittedFor = 0;
  }

  /** Look at all columns from the front, or from an angle around the vertical [rad]. */
  fit(around = 0) {
    const tangent = Math.tan((ANGLE / 2) * (Math.PI / 180));
    const high = (MARGIN * this.size.y) / (2 * tangent);
    const wide = (MARGIN * (this.breadth ?? this.size.x)) / (2 * tangent * this.camera.aspect);
    const away = Math.max(high, wide) + this.size.z / 2;
    const from = new Vector3(Math.sin(around), 0.04, Math.cos(around)).normalize();
    this.camera.near = away / 50;
    this.camera.far = away * 20;
    this.camera.position.copy(this.centre).addScaledVector(from, away);
    this.camera.updateProjectionMatrix();
    this.controls.target.copy(this.centre);
    this.controls.update();
    this.turned = false;
    this.ask();
  }

  resize() {
    const width = Math.max(1, this.place.clientWidth), height = Math.max(1, this.place.clientHeight);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (!this.turned) this.fit();
    this.ask();
  }

  /** Draw once, at the next frame of the screen. */
  ask() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      this.draw();
    });
  }

  draw() {
    this.arrange();
    for (const call of this.before) call();
    this.renderer.render(this.scene, this.camera);
    this.placeTags();
    this.frames++;
  }

  /** Stand the columns beside each other as the camera sees them: from the side, too. */
  arrange() {
    this.camera.updateMatrixWorld();
    const right = new Vector3().setFromMatrixColumn(this.camera.matrixWorld, 0);
    for (const { group, away } of this.columns) group.position.copy(right).multiplyScalar(away);
  }

  /** Put the names of the columns below them. */
  placeTags() {
    const at = new Vector3();
    for (const { group, tag } of this.columns) {
      at.copy(this.centre).add(group.position);
      at.y -= 0.5 * this.size.y;
      at.project(this.camera);
      const x = ((at.x + 1) / 2) * this.place.clientWidth;
      tag.style.transform = `translate(-50%, 0) translate(${x.toFixed(1)}px, 0)`;
    }
  }

  /** Where one of some `Markers` is on the stage, in pixels; null if it is hidden. */
  screen(markers, index) {
    if (markers.positions[3 * index] > 1e5) return null;
    const at = new Vector3().fromArray(markers.positions, 3 * index);
    at.applyMatrix4(markers.points.matrixWorld).project(this.camera);
    const { clientWidth, clientHeight } = this.place;
    return { x: ((at.x + 1) / 2) * clientWidth, y: ((1 - at.y) / 2) * clientHeight, depth: at.z };
  }

  /** The marker under a pointer: { markers, index }; null if there is none within `NEAR`. */
  nearest(event, sets) {
    const box = this.place.getBoundingClientRect();
    const x = event.clientX - box.left, y = event.clientY - box.top;
    let best = null;
    for (const markers of sets)
      for (let index = 0; index < markers.extents.length; index++) {
        const at = this.screen(markers, index);
        if (!at) continue;
        const away = Math.hypot(at.x - x, at.y - y);
        // Of two that are as near, the one in front.
        const score = away + 1e4 * at.depth;
        if (away < NEAR && (!best || score < best.score)) best = { markers, index, score };
      }
    return best;
  }

  /** Put a label beside a marker; hide it where that is hidden. */
  label(label, markers, index, text) {
    const at = index === undefined ? null : this.screen(markers, index);
    label.hidden = !at;
    if (!at) return;
    label.textContent = text;
    // On the other side of the marker where it would be cut.
    const cut = at.x + 10 + label.offsetWidth > this.place.clientWidth;
    const x = cut ? at.x - 10 - label.offsetWidth : at.x + 10;
    label.style.transform = `translate(${x.toFixed(1)}px, ${(at.y - 9).toFixed(1)}px)`;
  }

  /** Where a pointer is on the canvas, -1 to 1. */
  pointer(event) {
    const box = this.renderer.domElement.getBoundingClientRect();
    return {
      x: ((event.clientX - box.left) / box.width) * 2 - 1,
      y: 1 - ((event.clientY - box.top) / box.height) * 2,
    };
  }
}

/** Whether WebGL is drawn by the processor. */
function inSoftware() {
  const context = document.createElement("canvas").getContext("webgl2");
  const known = context?.getExtension("WEBGL_debug_renderer_info");
  const name = known ? context.getParameter(known.UNMASKED_RENDERER_WEBGL) : "";
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}
