// The page of a shot or a face: everything on one clock.

import { Group, Matrix4 } from "three";
import { Character } from "usdface/character";
import { Curves, Gaps } from "usdface/curves";
import { readData, row } from "usdface/data";
import { button, element, findingLines, isForControl, mouseKeepsNoFocus, toggle } from "usdface/dom";
import { Footage } from "usdface/footage";
import { Heat, RAMPS, css } from "usdface/heat";
import { Markers } from "usdface/markers";
import { Player, timecodeAt } from "usdface/player";
import { Emotions, Rules } from "usdface/rules";
import { Sliders } from "usdface/sliders";
import { Stage } from "usdface/stage";
import { Timeline, worstFrames } from "usdface/timeline";
import { showVerdict } from "usdface/verdict";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2];
const MODES = [
  ["raw", "raw", "1", "as solved, before the correction"],
  ["corrected", "corrected", "2", "as the layers play it"],
  ["both", "side by side", "3", "raw and corrected"],
  ["change", "difference", "4", "how far the correction moves the skin"],
];

class View {
  constructor(page) {
    this.page = page;
    this.player = new Player();
    this.character = new Character(page.character, () => this.stage?.ask());
    this.figures = { raw: this.character.copy(), corrected: this.character.copy() };
    this.stage = new Stage(document.getElementById("stage"), this.character.faceBox());
    this.stage.before.push(() => (this.pose(), this.name()));
    this.label = element("span", { class: "label" });
    this.stage.place.append(this.label);
    this.clip = page.clips[0] ?? still(page.character.shapes.length);
    this.hasRaw = !!this.clip.weights.raw;
    this.mode = "corrected";
    this.on = { heat: false, markers: !!page.performer, features: false };
    this.markers();
    this.panels();
    this.transport();
    this.loadClip(this.clip);
    this.player.onChange(() => this.changed());
    mouseKeepsNoFocus();
    this.stage.renderer.domElement.addEventListener("pointermove", (event) => this.point(event));
    document.addEventListener("keydown", (event) => this.key(event));
    addEventListener("hashchange", () => this.follow());
    this.layout();
    this.follow();
  }

  // -- what stands on the stage ------------------------------------------------------------

  markers() {
    const { performer, features, face } = this.page;
    if (performer) {
      this.performer = new Markers(performer.names.length, "#9fb4cc");
      performer.bound.forEach((bound, i) => this.performer.tint(i, bound ? "#dfe9f5" : "#6c7480"));
      this.performerGroup = new Group();
      this.performerHead = carriedGroup();
      this.performerHead.add(this.performer.points);
      this.performerGroup.add(this.performerHead);
    }
    if (features) {
      this.heat = new Heat(this.character, face.mesh);
      this.most = Math.max(2, quantile(features.residual_mm.values, 0.98));
      this.features = Object.values(this.figures).map((figure) => {
        const points = new Markers(features.names.length, "#4ad3ff", 6);
        const head = carriedGroup();
        head.add(points.points);
        figure.group.add(head);
        return { points, head };
      });
    } else if (this.hasRaw) this.heat = new Heat(this.character, face?.mesh ?? 0);
  }

  layout() {
    const names = { raw: ["raw"], corrected: ["corrected"], both: ["raw", "corrected"], change: ["corrected"] };
    const labels = this.hasRaw ? { raw: "raw", corrected: this.mode === "change" ? "difference" : "corrected" } : { corrected: "" };
    const columns = names[this.mode].map((name) => ({ group: this.figures[name].group, label: this.held ? "as the sliders" : labels[name] }));
    if (this.performer && this.on.markers) columns.push({ group: this.performerGroup, label: "performer" });
    this.stage.show(columns);
    for (const { points } of this.features ?? []) points.points.visible = this.on.features;
    if (this.heat) this.heat.wear(Object.values(this.figures), this.mode === "change" || (this.on.heat && !!this.page.features));
    this.legend();
    this.refreshButtons();
    this.changed();
  }

  /** Bring everything on the stage to the frame of the play head. */
  pose() {
    const frame = this.player.frame, { weights, joints } = this.clip;
    const corrected = row(weights.corrected, frame);
    const poses = { raw: weights.raw ? row(weights.raw, frame) : corrected, corrected };
    const held = this.sliders.weights;
    for (const [name, figure] of Object.entries(this.figures)) {
      figure.pose(held ?? poses[name]);
      figure.move(joints, frame);
    }
    const carried = this.figures.corrected.carried(this.page.face?.carrier ?? -1);
    if (this.performer && this.on.markers) {
      this.performer.move(this.page.performer.positions, frame);
      setMatrix(this.performerHead, carried);
    }
    for (const { points, head } of this.features ?? []) {
      if (!this.on.features) continue;
      points.move(this.page.features.positions, frame);
      setMatrix(head, carried);
    }
    if (this.mode === "change") this.largest = this.heat.change(poses.raw, poses.corrected, this.scale());
    else if (this.on.heat && this.page.features)
      this.note.textContent = this.heat.residual(this.page.features, frame, this.most) ? "" : "all markers are occluded";
    if (this.mode === "change") this.note.textContent = `largest ${this.largest.toFixed(1)} mm`;
  }

  /** The markers that a pointer can meet, each with its names and what is said beside these. */
  named() {
    const { performer, features } = this.page, sets = [];
    if (this.performer && this.on.markers) sets.push({ markers: this.performer, names: performer.names });
    if (this.features && this.on.features)
      for (const [i, { points }] of this.features.entries())
        if (this.stage.columns.some(({ group }) => group === Object.values(this.figures)[i].group))
          sets.push({ markers: points, names: features.names, residuals: features.residual_mm });
    return sets;
  }

  /** Name the marker under the pointer. */
  name() {
    const { markers, index } = this.pointed ?? {};
    const set = this.named().find((each) => each.markers === markers);
    if (set) this.stage.scene.updateMatrixWorld();
    const residual = set?.residuals ? row(set.residuals, this.player.frame)[index] : NaN;
    const text = set && set.names[index] + (Number.isNaN(residual) ? "" : `  ${residual.toFixed(1)} mm`);
    this.stage.label(this.label, markers, set ? index : undefined, text);
  }

  point(event) {
    const found = event.buttons ? null : this.stage.nearest(event, this.named().map(({ markers }) => markers));
    if (found?.index === this.pointed?.index && found?.markers === this.pointed?.markers) return;
    this.pointed = found;
    this.stage.ask();
  }

  scale() {
    return 5; // [mm], the end of the colours of the difference
  }

  legend() {
    const place = document.getElementById("legend");
    const change = this.mode === "change", shown = change || (this.on.heat && !!this.page.features);
    place.hidden = !shown;
    if (!shown) return;
    const ramp = change ? RAMPS.change : RAMPS.residual, most = change ? this.scale() : this.most;
    const bar = element("i");
    const stops = Array.from({ length: 9 }, (_, i) => css(ramp, i / 8));
    bar.style.background = `linear-gradient(to right, ${stops.join(", ")})`;
    this.note = element("span", { class: "note" });
    place.replaceChildren(
      element("span", { text: change ? "moved by the correction" : "residual of the solve" }),
      element("span", { class: "scale" }, [element("b", { text: "0" }), bar, element("b", { text: `${most.toFixed(1)} mm` })]),
      this.note,
    );
  }

  // -- what stands around it ---------------------------------------------------------------

  panels() {
    const { page, player } = this;
    const range = () => this.timeline?.range ?? [0, player.count - 1];
    const place = document.getElementById("panel");
    const tabs = [];
    const add = (name, build) => {
      const body = element("section", { class: "tab", role: "tabpanel", "aria-label": name });
      tabs.push({ name, body, view: build(body) });
    };
    showVerdict(document.getElementById("verdict"), page.verdict, (frame) => player.seek(frame));
    if (page.rules || Object.keys(page.emotions ?? {}).length)
      add("expression", (body) => {
        const emotions = new Emotions(body, page);
        body.append(element("h2", { text: "rules that fire" }));
        const list = element("div", { class: "rules" });
        body.append(list);
        const rules = new Rules(list, page);
        return { show: (frame) => (emotions.show(frame), rules.show(frame)) };
      });
    if (page.clips.length) add("curves", (body) => (this.curves = new Curves(body, player, range, page)));
    if (page.gaps?.length) add("gaps", (body) => (this.gaps = new Gaps(body, player, range, page.gaps)));
    add("shapes", (body) => {
      this.sliders = new Sliders(body, page.character, (weights) => this.hold(weights));
      return { show: (frame) => this.sliders.show(row(this.clip.weights[this.mode === "raw" ? "raw" : "corrected"], frame)) };
    });
    if (page.footage) add("footage", (body) => new Footage(body, page.footage, (frame) => player.seek(frame)));
    add("notes", (body) => notes(body, page));
    this.tabs = tabs;
    this.bar = element("nav", { role: "tablist" }, tabs.map((tab) => (tab.button = element("button", { type: "button", role: "tab", text: tab.name, on: { click: () => this.open(tab.name) } }))));
    place.append(this.bar, ...tabs.map(({ body }) => body));
    this.open(tabs[0].name);
  }

  open(name) {
    this.tab = name;
    for (const tab of this.tabs) {
      tab.body.hidden = tab.name !== name;
      tab.button.setAttribute("aria-selected", tab.name === name);
    }
    this.showPanel();
  }

  showPanel() {
    this.tabs.find(({ name }) => name === this.tab).view?.show?.(this.player.frame);
  }

  transport() {
    const place = document.getElementById("transport"), { player } = this;
    this.buttons = [];
    const switched = (text, title, isOn, press) => {
      const made = toggle(text, title, isOn, press);
      this.buttons.push(made);
      return made;
    };
    this.playButton = button("play", "space", () => player.toggle());
    this.playButton.className = "play";
    this.frameInput = element("input", { type: "number", min: 0, "aria-label": "frame" });
    this.frameInput.addEventListener("change", () => {
      player.seek(Number(this.frameInput.value));
      this.frameInput.value = player.frame;
    });
    this.frameInput.addEventListener("keydown", (event) => event.key === "Enter" && this.frameInput.blur());
    this.clock = element("span", { class: "clock" });
    this.speed = element("select", { title: "speed: [ and ]", "aria-label": "speed" }, SPEEDS.map((speed) => element("option", { value: speed, text: `${speed}×` })));
    this.speed.addEventListener("change", () => player.setSpeed(Number(this.speed.value)));
    const modes = this.hasRaw ? MODES.map(([mode, text, key, title]) => switched(text, `${title} (${key})`, () => this.mode === mode, () => this.setMode(mode))) : [];
    const shows = [
      this.page.features && switched("heat", "residual on the skin (h)", () => this.on.heat, () => this.switch("heat")),
      this.page.features && switched("points", "feature points on the face (p)", () => this.on.features, () => this.switch("features")),
      this.performer && switched("performer", "the performer's markers (m)", () => this.on.markers, () => this.switch("markers")),
    ].filter(Boolean);
    const clips = this.page.clips.length > 1 && element("select", { "aria-label": "clip" }, this.page.clips.map((clip, i) => element("option", { value: i, text: clip.name })));
    if (clips) clips.addEventListener("change", () => (this.loadClip(this.page.clips[Number(clips.value)]), this.layout()));
    const plays = this.page.clips.length > 0;
    place.append(
      ...(plays ? [
        button("|◀", "to the start (home)", () => player.seek(player.range[0])),
        button("◀", "one frame back (←)", () => player.step(-1)),
        this.playButton,
        button("▶", "one frame on (→)", () => player.step(1)),
        switched("loop", "loop (l); shift and drag on the timeline plays a part", () => player.loop, () => player.setLoop(!player.loop)),
        this.speed,
        clips || "",
        element("label", { class: "frame" }, [element("span", { text: "frame" }), this.frameInput]),
        this.clock,
      ] : []),
      element("span", { class: "space" }),
      element("span", { class: "set" }, modes),
      element("span", { class: "set" }, shows),
    );
  }

  loadClip(clip) {
    this.clip = clip;
    const figure = this.figures.corrected;
    figure.move(clip.joints, 0);
    this.stage.look(this.character.faceBox().applyMatrix4(figure.carried(this.character.carrier())));
    this.curves?.load(clip);
    this.player.load(clip, this.page.start_timecode);
    const { residual, emotions } = this.page;
    const place = document.getElementById("timeline");
    place.replaceChildren();
    this.worst = residual ? worstFrames(residual.all_mm.values, Math.max(8, Math.round(clip.rate / 3))) : [];
    if (this.player.count > 1)
      this.timeline = new Timeline(place, this.player, { residual, emotions, marks: { worst: this.worst } });
    else place.hidden = true;
  }

  // -- changes -----------------------------------------------------------------------------

  setMode(mode) {
    if (!this.hasRaw) return;
    this.mode = mode;
    this.layout();
  }

  /** The sliders hold the face still, or leave it to the clip: its name says so on every tab. */
  hold(weights) {
    if (this.held !== !!weights) {
      this.held = !!weights;
      this.layout();
    }
    this.showPanel();
    this.stage.ask();
  }

  switch(name) {
    this.on[name] = !this.on[name];
    this.layout();
  }

  refreshButtons() {
    for (const button of this.buttons) button.refresh();
  }

  changed() {
    const { player } = this;
    this.playButton.textContent = player.playing ? "pause" : "play";
    if (document.activeElement !== this.frameInput) this.frameInput.value = player.frame;
    this.frameInput.max = player.count - 1;
    const seconds = player.times[player.frame];
    this.clock.textContent = `of ${player.count - 1}   ${seconds.toFixed(3)} s   ${timecodeAt(this.page.start_timecode, seconds, player.rate)}`;
    this.speed.value = String(SPEEDS.includes(player.speed) ? player.speed : 1);
    this.refreshButtons();
    this.showPanel();
    this.stage.ask();
    if (!player.playing) this.remember();
  }

  /** Keep the frame in the address; a page that is reloaded or linked to opens there. */
  remember() {
    clearTimeout(this.remembering);
    this.remembering = setTimeout(() => history.replaceState(null, "", `#frame=${this.player.frame}`), 200);
  }

  follow() {
    const found = /frame=(\d+)/.exec(location.hash);
    if (found && Number(found[1]) !== this.player.frame) this.player.seek(Number(found[1]));
  }

  nextWorst() {
    const next = this.worst.find((frame) => frame > this.player.frame) ?? this.worst[0];
    if (next !== undefined) this.player.seek(next);
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || isForControl(event)) return;
    const { player } = this, far = event.shiftKey ? 10 : 1;
    const keys = {
      " ": () => player.toggle(), ArrowLeft: () => player.step(-far), ArrowRight: () => player.step(far),
      Home: () => player.seek(player.range[0]), End: () => player.seek(player.range[1]),
      1: () => this.setMode("raw"), 2: () => this.setMode("corrected"), 3: () => this.setMode("both"), 4: () => this.setMode("change"),
      c: () => this.setMode(this.mode === "raw" ? "corrected" : "raw"),
      h: () => this.page.features && this.switch("heat"), p: () => this.features && this.switch("features"), m: () => this.performer && this.switch("markers"),
      l: () => player.setLoop(!player.loop), i: () => player.setRange(player.frame, player.range[1]), o: () => player.setRange(player.range[0], player.frame),
      x: () => player.setRange(), w: () => this.nextWorst(), f: () => this.stage.fit(), g: () => this.stage.fit(0.7),
      "[": () => player.setSpeed(SPEEDS[Math.max(0, SPEEDS.indexOf(player.speed) - 1)]),
      "]": () => player.setSpeed(SPEEDS[Math.min(SPEEDS.length - 1, SPEEDS.indexOf(player.speed) + 1)]),
    };
    const act = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act) return;
    event.preventDefault();
    act();
  }

  /** The weights of the morph targets that are shown: mesh to list, of one figure. */
  influences(name) {
    this.pose();
    return this.figures[name].meshes.map((mesh) => Array.from(mesh.morphTargetInfluences ?? []));
  }
}

function still(count) {
  const table = { values: new Float32Array(Math.max(count, 1)), shape: [1, count], width: count };
  return { name: "", rate: 24, ticks: { values: [0] }, weights: { corrected: table }, joints: null };
}

function carriedGroup() {
  const group = new Group();
  group.matrixAutoUpdate = false;
  return group;
}

function setMatrix(group, matrix) {
  group.matrix.copy(matrix ?? new Matrix4());
  group.matrixWorldNeedsUpdate = true;
}

function quantile(values, share) {
  const known = values.filter((value) => value === value).sort();
  return known[Math.floor(share * (known.length - 1))] ?? 0;
}

const KEYS = [
  ["space", "play, pause"], ["← →", "one frame; with shift ten"], ["home end", "start, end"], ["1 2 3 4", "raw, corrected, side by side, difference"],
  ["c", "raw or corrected"], ["h p m", "heat, feature points, performer"], ["w", "next frame with a large residual"], ["l i o x", "loop, its start, its end, all"],
  ["[ ]", "slower, faster"], ["f g", "front, three quarters"],
];

function notes(place, page) {
  const facts = Object.entries(page.facts ?? {});
  place.append(
    element("dl", {}, facts.flatMap(([name, value]) => [element("dt", { text: name.replaceAll("_", " ") }), element("dd", { text: String(value) })])),
    ...findingLines(page.findings),
    element("h2", { text: "keys" }),
    element("dl", { class: "keys" }, KEYS.flatMap(([key, text]) => [element("dt", { text: key }), element("dd", { text })])),
    element("p", { class: "note", text: "Timeline: click or drag to go there, wheel to zoom, double click for all, shift and drag to loop a part." }),
  );
}

try {
  const view = new View(await readData());
  view.stage.draw();
  view.opened = performance.now(); // [ms] since the browser began to open the page
  globalThis.usdface = view;
  document.body.dataset.ready = "true";
} catch (error) {
  document.body.dataset.ready = "failed";
  document.getElementById("stage").append(element("p", { class: "failed", text: `This page cannot be shown: ${error.message}` }));
  throw error;
}
