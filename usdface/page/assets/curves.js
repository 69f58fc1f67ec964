// Curves of the weights with their standard deviation, and of the gaps of lids and lips.

import { axis, curve } from "usdface/chart";
import { element, fitted } from "usdface/dom";

export const RAW = "#7f8b9c", CORRECTED = "#f2a65a";
const MOVES = 0.01;

/** One row: a name, a value at the play head, curves. */
class Row {
  constructor(list, name, note, draw, value) {
    this.list = list;
    this.draw = draw;
    this.value = value;
    this.number = element("b");
    this.canvas = element("canvas");
    this.head = element("div", { class: "head" });
    const area = element("div", { class: "area" }, [this.canvas, this.head]);
    this.node = element("div", { class: "curve" }, [
      element("div", { class: "title" }, [
        element("span", { class: "name", text: name, title: note }),
        this.number,
      ]),
      area,
    ]);
    const go = (event) => {
      const box = this.canvas.getBoundingClientRect();
      list.player.seek(axis(list.range(), box.width).frame(event.clientX - box.left));
    };
    area.addEventListener("pointerdown", (event) => {
      area.setPointerCapture(event.pointerId);
      go(event);
    });
    area.addEventListener("pointermove", (event) => event.buttons && go(event));
  }

  redraw() {
    const { context, width, height } = fitted(this.canvas);
    if (width < 2) return;
    context.fillStyle = "#1c2026";
    context.fillRect(0, 0, width, height);
    this.draw(context, width, height, this.list.range());
    this.drawn = true;
  }

  show(frame) {
    const { x } = axis(this.list.range(), this.canvas.clientWidth || 1);
    this.head.style.transform = `translateX(${x(frame)}px)`;
    this.number.textContent = this.value(frame);
  }
}

/** A list of rows of which those on screen are drawn. */
class RowList {
  constructor(place, player, range) {
    this.place = place;
    this.player = player;
    this.range = range;
    this.rows = new Map();
    this.seen = new Set();
    this.observer = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) {
        const own = this.rows.get(target);
        if (!own) continue;
        if (!isIntersecting) this.seen.delete(own);
        else {
          this.seen.add(own);
          own.redraw();
          own.show(player.frame);
        }
      }
    });
  }

  set(rows) {
    this.observer.disconnect();
    this.seen.clear();
    this.rows = new Map(rows.map((each) => [each.node, each]));
    this.place.replaceChildren(...this.rows.keys());
    for (const node of this.rows.keys()) this.observer.observe(node);
  }

  show(frame) {
    const range = this.range().join(), zoomed = range !== this.drawnFor;
    this.drawnFor = range;
    for (const each of this.seen) {
      if (zoomed) each.redraw();
      each.show(frame);
    }
  }
}

/** Weights of the blend shapes that move, filtered by region and name. */
export class Curves extends RowList {
  constructor(place, player, range, page) {
    const list = element("div", { class: "rows" });
    super(list, player, range);
    this.page = page;
    this.filter = element("input", { type: "search", placeholder: "blend shape", "aria-label": "filter blend shapes by name" });
    const regions = [...new Set(page.regions ?? [])].filter(Boolean);
    this.region = element("select", { "aria-label": "region" }, ["all regions", ...regions].map((name) => element("option", { text: name })));
    this.filter.addEventListener("input", () => this.choose());
    this.region.addEventListener("change", () => this.choose());
    place.append(element("div", { class: "filter" }, [regions.length ? this.region : null, this.filter]), list);
  }

  /** Take the weights of a clip. */
  load(clip) {
    this.weights = clip.weights;
    this.choose();
  }

  choose() {
    const { corrected, raw } = this.weights, shapes = this.page.character.shapes;
    const wanted = this.filter.value.trim().toLowerCase();
    const region = this.region.selectedIndex > 0 ? this.region.value : "";
    const chosen = shapes
      .map((name, shape) => ({ name, shape, size: reach(corrected, shape) + (raw ? reach(raw, shape) : 0) }))
      .filter(({ name, size, shape }) => size > MOVES && name.toLowerCase().includes(wanted) && (!region || this.page.regions[shape] === region));
    this.set(chosen.map(({ name, shape }) => this.rowOf(name, shape)));
    if (!chosen.length) this.place.append(element("p", { class: "note", text: "No such blend shape moves." }));
  }

  rowOf(name, shape) {
    const { corrected, raw } = this.weights, deviation = this.page.deviations?.[shape] ?? 0;
    const low = Math.min(0, least(corrected, shape)), high = Math.max(1, most(corrected, shape));
    const draw = (context, width, height, range) => {
      const scale = (value) => height - 2 - ((value - low) / (high - low)) * (height - 4);
      const common = { stride: corrected.width, offset: shape, range, width, scale };
      if (raw) curve(context, raw.values, { ...common, colour: RAW, spread: deviation });
      curve(context, corrected.values, { ...common, colour: CORRECTED, spread: raw ? 0 : deviation });
    };
    const at = (table, frame) => table.values[frame * table.width + shape].toFixed(2);
    const value = (frame) => (raw && at(raw, frame) !== at(corrected, frame) ? `${at(raw, frame)} → ` : "") + at(corrected, frame) + (deviation ? ` ± ${deviation.toFixed(2)}` : "");
    return new Row(this, name, name, draw, value);
  }
}

/** Gaps of lids and lips [mm]. */
export class Gaps extends RowList {
  constructor(place, player, range, gaps) {
    const list = element("div", { class: "rows tall" });
    super(list, player, range);
    const key = element("p", { class: "note", text: "Millimetres. Solid: where the slit is open widest. Thin: its least gap; below the line the two sides cross." });
    place.append(key, list);
    this.set(gaps.map((gap) => this.rowOf(gap)));
  }

  rowOf({ name, corrected, raw }) {
    const tables = [corrected, raw].filter(Boolean).flatMap((layer) => [layer.widest_mm, layer.least_mm]);
    const values = tables.map((table) => table.values);
    const high = Math.max(1, ...values.map((own) => own.reduce((a, b) => Math.max(a, b), 0)));
    const low = Math.min(-0.5, ...values.map((own) => own.reduce((a, b) => Math.min(a, b), 0)));
    const draw = (context, width, height, range) => {
      const scale = (value) => height - 2 - ((value - low) / (high - low)) * (height - 4);
      context.fillStyle = "#4a515c";
      context.fillRect(0, scale(0), width, 1);
      for (const [layer, colour] of [[raw, RAW], [corrected, CORRECTED]]) {
        if (!layer) continue;
        curve(context, layer.least_mm.values, { range, width, scale, colour, line: 0.7 });
        curve(context, layer.widest_mm.values, { range, width, scale, colour, line: 1.5 });
      }
    };
    const value = (frame) => `${corrected.least_mm.values[frame].toFixed(1)} to ${corrected.widest_mm.values[frame].toFixed(1)} mm`;
    return new Row(this, name, name, draw, value);
  }
}

const reach = (table, shape) => most(table, shape) - Math.min(0, least(table, shape));

function most(table, shape) {
  let found = 0;
  for (let i = shape; i < table.values.length; i += table.width) found = Math.max(found, table.values[i]);
  return found;
}

function least(table, shape) {
  let found = 0;
  for (let i = shape; i < table.values.length; i += table.width) found = Math.min(found, table.values[i]);
  return found;
}
