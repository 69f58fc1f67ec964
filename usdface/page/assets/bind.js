// The page to place markers on: look at the proposed places, move them, save bind.json.

import { Group } from "three";
import { axis, curve } from "usdface/chart";
import { Character } from "usdface/character";
import { readData } from "usdface/data";
import { button, element, findingLines, fitted, isForControl, mouseKeepsNoFocus } from "usdface/dom";
import { Markers } from "usdface/markers";
import { Places, SURE, bindDocument } from "usdface/places";
import { Player, timecodeAt } from "usdface/player";
import { Skin } from "usdface/skin";
import { Stage } from "usdface/stage";

const MOVED = 4; // pixels after which a press is a drag
const COLOURS = { sure: "#6fd08c", middling: "#f2c14e", unsure: "#ff7a5c", hand: "#5cb8ff", out: "#6c7480" };
const HEIGHT = 64;

class Bind {
  constructor(page) {
    this.page = page;
    this.player = new Player();
    this.places = new Places(page.markers, page.partners, page.mirror.values, { neutral: page.neutral, noseTip: page.nose_tip });
    this.character = new Character(page.character, () => this.stage?.ask());
    this.part = this.character.parts[page.mesh];
    this.figure = this.character.copy();
    this.stage = new Stage(document.getElementById("stage"), this.character.faceBox());
    this.skin = new Skin(this.part);
    this.figure.group.add(this.skin.mesh);
    this.markers = new Markers(page.markers.length, COLOURS.sure, 9);
    this.figure.group.add(this.markers.points);
    this.performer = new Markers(page.markers.length, "#9fb4cc", 7);
    this.performerGroup = new Group();
    this.performerGroup.add(this.performer.points);
    this.labels = [0, 1].map(() => element("span", { class: "label" }));
    this.stage.place.append(...this.labels);
    this.stage.before.push(() => this.pose());
    this.stage.show([{ group: this.figure.group, label: "character" }, { group: this.performerGroup, label: "performer" }]);
    this.player.load(page.clip, page.start_timecode);
    this.panel();
    this.transport();
    this.timeline();
    this.pointer();
    this.player.onChange(() => this.changed());
    if (this.neutral) this.player.seek(this.neutral[0]);
    mouseKeepsNoFocus();
    addEventListener("keydown", (event) => this.key(event));
    addEventListener("beforeunload", (event) => this.places.undoable && !this.saved && event.preventDefault());
    this.select(this.places.order()[0] ?? 0);
  }

  get neutral() {
    return this.places.neutral;
  }

  // -- the stage -----------------------------------------------------------------------------

  pose() {
    const { places, part } = this, positions = new Float32Array(3 * places.count).fill(NaN);
    this.stage.scene.updateMatrixWorld();
    const from = this.skin.mesh.worldToLocal(this.stage.camera.position.clone());
    for (let i = 0; i < places.count; i++) {
      const point = places.shown(i);
      // Markers shine through hair, but those behind the head would be taken for others.
      if (point >= 0 && (i === this.selected || !this.skin.turnedAway(point, from))) positions.set(part.points.subarray(3 * point, 3 * point + 3), 3 * i);
    }
    this.markers.place(positions);
    this.performer.move(this.page.positions, this.player.frame);
    for (let i = 0; i < places.count; i++) {
      const selected = i === this.selected;
      this.markers.tint(i, selected ? "#ffffff" : COLOURS[places.kind(i)]);
      this.markers.grow(i, selected ? 13 : 9);
      this.performer.tint(i, selected ? "#ffffff" : COLOURS[places.kind(i)]);
      this.performer.grow(i, selected ? 12 : 7);
    }
    const shown = this.hovered ?? this.selected;
    [this.markers, this.performer].forEach((markers, i) =>
      this.stage.label(this.labels[i], markers, shown, this.page.markers[shown]?.name));
  }

  // -- the pointer ---------------------------------------------------------------------------

  pointer() {
    const canvas = this.stage.renderer.domElement;
    // Before the controls of the camera, which let go of what is dragged here.
    canvas.addEventListener("pointerdown", (event) => this.press(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.drag(event), { capture: true });
    canvas.addEventListener("pointerup", (event) => this.release(event), { capture: true });
  }

  press(event) {
    if (event.button !== 0) return;
    const held = this.nearest(event);
    this.pressed = { x: event.clientX, y: event.clientY, held: held?.index, movable: held?.markers === this.markers, moved: false };
    if (held) {
      this.select(held.index);
      this.stage.controls.enabled = false;
      event.target.setPointerCapture(event.pointerId);
    }
  }

  drag(event) {
    const { pressed } = this;
    if (!pressed) {
      const near = this.nearest(event)?.index;
      if (near !== this.hovered) {
        this.hovered = near;
        this.stage.renderer.domElement.style.cursor = near === undefined ? "" : "grab";
        this.stage.ask();
      }
      return;
    }
    if (Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) > MOVED) {
      if (!pressed.moved && pressed.movable) this.places.begin();
      pressed.moved = true;
    }
    if (!pressed.movable || !pressed.moved) return;
    const vertex = this.vertexAt(event);
    if (vertex >= 0) {
      this.places.put(pressed.held, vertex);
      this.edited();
    }
  }

  release(event) {
    const { pressed } = this;
    if (pressed?.moved && pressed.movable && !this.places.end()) this.refresh();
    this.pressed = null;
    this.stage.controls.enabled = true;
    if (!pressed || pressed.moved || pressed.held !== undefined) return;
    const vertex = this.vertexAt(event);
    if (vertex < 0 || this.selected === undefined) return;
    this.places.begin();
    this.places.put(this.selected, vertex);
    this.edited();
  }

  /** The marker under the pointer, on the face or among the performer's. */
  nearest(event) {
    return this.stage.nearest(event, [this.markers, this.performer]);
  }

  /** The vertex of the face under the pointer, -1 off it. */
  vertexAt(event) {
    return this.skin.vertexAt(this.stage.pointer(event), this.stage.camera);
  }

  // -- the panel -----------------------------------------------------------------------------

  panel() {
    this.count = element("p", { class: "note" });
    this.rows = this.page.markers.map(({ name }, index) => {
      const dot = element("i"), state = element("span", { class: "state" }), nose = element("span", { class: "state" });
      const node = element("button", { class: "place", type: "button", on: { click: () => this.select(index) } }, [dot, element("span", { class: "name", text: name, title: name }), nose, state]);
      return { node, dot, state, nose };
    });
    this.tools = [
      button("accept", "right as it is; go on to the next (enter)", () => this.accept()),
      button("leave out", "wrong, or not on the face (delete)", () => this.leaveOut()),
      button("from mirror", "place it opposite its partner (m)", () => this.fromPartner()),
      button("as proposed", "back to the proposal (r)", () => this.change((places) => places.reset(this.selected))),
      button("nose tip", "distances are measured to this marker (t)", () => this.setNose()),
    ];
    this.undoButton = button("undo", "z", () => this.undo());
    const list = element("div", { class: "places", role: "listbox", "aria-label": "markers" }, this.places.order().map((index) => this.rows[index].node));
    const body = element("section", { class: "tab" }, [
      element("div", { class: "tools kept" }, [
        element("button", { class: "save", type: "button", text: "save bind.json", title: "for usdface shot --bind (s)", on: { click: () => this.save() } }),
        this.undoButton,
      ]),
      this.count,
      element("h2", { text: "selected marker" }),
      element("div", { class: "tools" }, this.tools),
      element("h2", { text: "mirror all" }),
      element("div", { class: "tools" }, [
        button("left → right", "the performer's left side decides", () => this.change((places) => places.mirrorAll((point) => this.part.points[3 * point] > this.middle))),
        button("right → left", "the performer's right side decides", () => this.change((places) => places.mirrorAll((point) => this.part.points[3 * point] <= this.middle))),
      ]),
      element("h2", { text: "markers" }),
      confidenceKey(),
      list,
      ...findingLines(this.page.findings),
      element("p", { class: "note", text: "Drag a marker along the skin, or click where the selected one belongs. n and p: next and previous marker, unsure ones first. Drag beside the face to turn it, f looks from the front, g from three quarters." }),
    ]);
    document.getElementById("panel").append(body);
    this.middle = this.page.middle;
  }

  refresh() {
    const { places } = this, counts = { bound: 0, unsure: 0, out: 0 };
    this.rows.forEach(({ node, dot, state, nose }, index) => {
      const kind = places.kind(index);
      counts[places.state(index)]++;
      node.setAttribute("aria-selected", index === this.selected);
      dot.style.background = COLOURS[kind];
      state.textContent = places.describe(index);
      nose.textContent = this.page.markers[index].name === places.noseTip ? "nose tip" : "";
    });
    this.count.textContent = `${counts.bound} placed, ${counts.unsure} unsure, ${counts.out} left out. Unsure ones are not used until they are moved or accepted.`;
    this.undoButton.disabled = !places.undoable;
    const { by, point } = places.now[this.selected] ?? {}, [accept, , mirror, reset] = this.tools;
    [accept.disabled, mirror.disabled, reset.disabled] = [!(point >= 0), !places.hasPartner(this.selected), by === "proposal"];
    const frames = this.neutral ? `neutral frames ${this.neutral[0]} to ${this.neutral[1]}` : "neutral: the rig's own";
    this.neutralNote.textContent = frames;
    this.stage.ask();
    this.drawTimeline();
  }

  select(index) {
    this.selected = index;
    const { node } = this.rows[index];
    node.scrollIntoView({ block: "nearest" });
    // A keyboard that has gone into the list goes along.
    if (document.activeElement?.matches(".place")) node.focus({ preventScroll: true });
    this.refresh();
  }

  edited() {
    this.saved = false;
    this.refresh();
  }

  change(edit) {
    this.places.begin();
    edit(this.places);
    if (this.places.end()) this.edited();
  }

  accept() {
    this.change((places) => places.accept(this.selected));
    this.next(1);
  }

  leaveOut() {
    this.change((places) => places.leaveOut(this.selected));
  }

  fromPartner() {
    this.change((places) => places.fromPartner(this.selected));
  }

  setNose() {
    this.change((places) => (places.noseTip = this.page.markers[this.selected].name));
  }

  undo() {
    this.places.undo();
    this.edited();
  }

  next(by) {
    const order = this.places.order(), at = order.indexOf(this.selected);
    this.select(order[(at + by + order.length) % order.length]);
  }

  // -- the take ------------------------------------------------------------------------------

  transport() {
    const { player } = this;
    this.playButton = button("play", "space", () => player.toggle());
    this.playButton.className = "play";
    this.clock = element("span", { class: "clock" });
    this.neutralNote = element("span", { class: "clock" });
    document.getElementById("transport").append(
      button("◀", "one frame back (←)", () => player.step(-1)), this.playButton, button("▶", "one frame on (→)", () => player.step(1)), this.clock,
      element("span", { class: "space" }), this.neutralNote,
      element("span", { class: "set" }, [
        button("neutral from here", "the face rests from this frame on (i)", () => this.setNeutral(0)),
        button("to here", "... to this one (o)", () => this.setNeutral(1)),
        button("rig's own", "the take's neutral is the rig's neutral mesh, in the same space", () => this.setNeutral(2)),
      ]),
    );
  }

  setNeutral(end) {
    const { frame } = this.player, [first, last] = this.neutral ?? [frame, frame];
    const neutral = end === 2 ? null : end === 0 ? [frame, Math.max(frame, last)] : [Math.min(first, frame), frame];
    this.change((places) => (places.neutral = neutral));
  }

  timeline() {
    const place = document.getElementById("timeline");
    this.canvas = element("canvas", { id: "ribbon" });
    this.head = element("div", { class: "head" });
    const area = element("div", { class: "area" }, [this.canvas, this.head]);
    area.style.height = `${HEIGHT}px`;
    place.append(element("div", { class: "labels" }, [element("span", { text: "motion" })]), area);
    const go = (event) => {
      const box = this.canvas.getBoundingClientRect();
      this.player.seek(axis([0, this.player.count - 1], box.width).frame(event.clientX - box.left));
    };
    area.addEventListener("pointerdown", (event) => {
      area.setPointerCapture(event.pointerId);
      go(event);
    });
    area.addEventListener("pointermove", (event) => event.buttons && go(event));
    new ResizeObserver(() => this.drawTimeline()).observe(area);
  }

  drawTimeline() {
    const { context, width, height } = fitted(this.canvas);
    if (width < 2) return;
    const range = [0, this.player.count - 1], { x } = axis(range, width);
    const values = this.page.motion_mm.values, most = Math.max(1, values.reduce((a, b) => (b > a ? b : a), 0));
    context.fillStyle = "#1c2026";
    context.fillRect(0, 0, width, height);
    if (this.neutral) {
      context.fillStyle = "rgb(111 208 140 / 0.35)";
      context.fillRect(x(this.neutral[0]), 0, Math.max(2, x(this.neutral[1]) - x(this.neutral[0])), height);
    }
    const scale = (value) => height - 3 - (value / most) * (height - 8);
    curve(context, values, { range, width, scale, colour: "#9fb4cc" });
    this.head.style.transform = `translateX(${x(this.player.frame)}px)`;
  }

  changed() {
    const { player } = this, seconds = player.times[player.frame];
    this.playButton.textContent = player.playing ? "pause" : "play";
    this.clock.textContent = `frame ${player.frame} of ${player.count - 1}   ${seconds.toFixed(3)} s   ${timecodeAt(this.page.start_timecode, seconds, player.rate)}`;
    this.drawTimeline();
    this.stage.ask();
  }

  key(event) {
    // Enter on the selected marker of the list accepts it, as elsewhere.
    const ours = event.target.matches?.(".place[aria-selected='true']") || !isForControl(event);
    if (event.ctrlKey || event.metaKey || event.altKey || !ours) return;
    const keys = {
      " ": () => this.player.toggle(), ArrowLeft: () => this.player.step(event.shiftKey ? -10 : -1), ArrowRight: () => this.player.step(event.shiftKey ? 10 : 1),
      Enter: () => this.accept(), Delete: () => this.leaveOut(), Backspace: () => this.leaveOut(),
      n: () => this.next(1), p: () => this.next(-1), m: () => this.fromPartner(), r: () => this.change((places) => places.reset(this.selected)),
      t: () => this.setNose(), z: () => this.undo(), s: () => this.save(), i: () => this.setNeutral(0), o: () => this.setNeutral(1),
      f: () => this.stage.fit(), g: () => this.stage.fit(0.7),
    };
    const act = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act) return;
    event.preventDefault();
    act();
  }

  // -- the result ----------------------------------------------------------------------------

  /** The binding file, as text. */
  document() {
    return bindDocument(this.page.document, this.places, this.page.neutral);
  }

  save() {
    const link = element("a", { download: "bind.json", href: URL.createObjectURL(new Blob([this.document()], { type: "application/json" })) });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    this.saved = true;
  }
}

/** What the numbers and the colours of the markers mean. */
function confidenceKey() {
  const words = { sure: `${SURE} or more`, middling: "less", unsure: "unsure", hand: "by hand", out: "left out" };
  const entries = Object.entries(words).map(([kind, text]) => {
    const dot = element("i");
    dot.style.background = COLOURS[kind];
    return element("span", {}, [dot, text]);
  });
  return element("p", { class: "note key" }, ["Confidence: how probably a place is within 10 mm of the true one.", ...entries]);
}

try {
  globalThis.usdface = new Bind(await readData());
  globalThis.usdface.stage.draw();
  document.body.dataset.ready = "true";
} catch (error) {
  document.body.dataset.ready = "failed";
  document.getElementById("stage").append(element("p", { class: "failed", text: `This page cannot be shown: ${error.message}` }));
  throw error;
}
