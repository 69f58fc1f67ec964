// The timeline: residual of each region and emotions over the frames; click to go there.

import { axis, columns, curve } from "usdface/chart";
import { element, fitted } from "usdface/dom";
import { RAMPS, css } from "usdface/heat";

const ROW = 15, GAP = 2, RULER = 20, EMOTIONS = 46;
export const EMOTION_COLOURS = {
  joy: "#f2c14e", sadness: "#5b8def", anger: "#e4572e", fear: "#a46bd6", disgust: "#6fbf57",
  surprise: "#3fc1c9",
};
const OTHERS = ["#f78fb3", "#9aa5b1", "#c7e07a", "#e0a57a", "#7ae0c3"];

/** A colour for each emotion. */
export function emotionColours(names) {
  let other = 0;
  return Object.fromEntries(
    names.map((name) => [name, EMOTION_COLOURS[name] ?? OTHERS[other++ % OTHERS.length]]),
  );
}

export class Timeline {
  constructor(place, player, shot) {
    this.player = player;
    this.residual = shot.residual;
    this.emotions = Object.entries(shot.emotions ?? {});
    this.colours = emotionColours(this.emotions.map(([name]) => name));
    this.rows = this.residual
      ? [["all", this.residual.all_mm.values], ...Object.entries(this.residual.regions_mm).map(([name, table]) => [name, table.values])]
      : [];
    this.marks = shot.marks ?? {};
    this.most = scaleOf(this.rows);
    this.view = null;
    this.build(place);
    player.onChange(() => this.refresh());
    new ResizeObserver(() => this.redraw()).observe(this.canvas);
  }

  build(place) {
    const height = RULER + this.rows.length * (ROW + GAP) + (this.emotions.length ? EMOTIONS + 4 : 0);
    this.height = Math.max(height, 34);
    const labels = element("div", { class: "labels" }, [
      element("span", { class: "ruler", text: this.rows.length ? "residual" : "" }),
      ...this.rows.map(([name]) => element("span", { text: name })),
      this.emotions.length ? element("span", { class: "emotions", text: "emotions" }) : null,
    ]);
    this.canvas = element("canvas", { id: "ribbon" });
    this.head = element("div", { class: "head" });
    const area = element("div", { class: "area" }, [this.canvas, this.head]);
    area.style.height = `${this.height}px`;
    place.append(labels, area);
    area.addEventListener("pointerdown", (event) => {
      area.setPointerCapture(event.pointerId);
      this.dragged = event.shiftKey ? [this.frameOf(event)] : null;
      this.scrub(event);
    });
    area.addEventListener("pointermove", (event) => event.buttons && this.scrub(event));
    area.addEventListener("wheel", (event) => this.zoom(event), { passive: false });
    area.addEventListener("dblclick", () => this.showAll());
  }

  get range() {
    return this.view ?? [0, this.player.count - 1];
  }

  frameOf(event) {
    const box = this.canvas.getBoundingClientRect();
    return axis(this.range, box.width).frame(event.clientX - box.left);
  }

  scrub(event) {
    const frame = this.frameOf(event);
    if (this.dragged) this.player.setRange(this.dragged[0], frame);
    this.player.seek(frame);
  }

  zoom(event) {
    event.preventDefault();
    const [first, last] = this.range, at = this.frameOf(event);
    const factor = Math.exp(event.deltaY * 0.002);
    const low = Math.max(0, Math.round(at - (at - first) * factor));
    const high = Math.min(this.player.count - 1, Math.round(at + (last - at) * factor));
    this.view = high - low < 10 ? this.view : [low, high];
    if (low === 0 && high === this.player.count - 1) this.view = null;
    this.zoomed();
  }

  showAll() {
    this.view = null;
    this.zoomed();
  }

  /** Redraw, also the curves, which show the same frames. */
  zoomed() {
    this.redraw();
    this.player.changed();
  }

  refresh() {
    const { x } = axis(this.range, this.canvas.clientWidth || 1);
    this.head.style.transform = `translateX(${x(this.player.frame)}px)`;
    const drawn = [...this.player.range, this.player.count].join();
    if (drawn !== this.drawnFor) this.redraw();
  }

  redraw() {
    const { context, width, height } = fitted(this.canvas);
    this.drawnFor = [...this.player.range, this.player.count].join();
    if (width < 2) return;
    this.drawRuler(context, width, height);
    let top = RULER;
    for (const [, values] of this.rows) {
      this.drawRibbon(context, values, top, width);
      top += ROW + GAP;
    }
    if (this.emotions.length) this.drawEmotions(context, top + 2, width);
    this.refresh();
  }

  drawRuler(context, width, height) {
    const { x } = axis(this.range, width), [first, last] = this.range;
    const step = niceStep(((last - first) / width) * 70);
    context.font = "10px system-ui, sans-serif";
    context.textBaseline = "middle";
    for (let frame = Math.ceil(first / step) * step; frame <= last; frame += step) {
      context.fillStyle = "#2a2f38";
      context.fillRect(x(frame), RULER - 5, 1, height);
      context.fillStyle = "#8b93a1";
      const text = String(frame);
      if (x(frame) + 3 + context.measureText(text).width < width) context.fillText(text, x(frame) + 3, 8);
    }
    const [from, to] = this.player.range;
    if (from > 0 || to < this.player.count - 1) {
      context.fillStyle = "rgb(242 166 90 / 0.9)";
      context.fillRect(x(from), RULER - 4, Math.max(2, x(to) - x(from)), 3);
    }
    for (const [kind, frames] of Object.entries(this.marks))
      for (const frame of frames) {
        context.fillStyle = kind === "worst" ? "#ff6b5e" : "#7fd1ae";
        context.beginPath();
        context.moveTo(x(frame) - 4, RULER - 8);
        context.lineTo(x(frame) + 4, RULER - 8);
        context.lineTo(x(frame), RULER - 1);
        context.fill();
      }
  }

  drawRibbon(context, values, top, width) {
    const [, high] = columns(values, 1, 0, this.range, width), { frame } = axis(this.range, width);
    context.fillStyle = "#23272e";
    context.fillRect(0, top, width, ROW);
    for (let x = 0; x < width; x++) {
      // Between two frames as in the first of them; nothing where no marker was seen.
      const residual = Number.isNaN(high[x]) ? values[Math.floor(frame(x))] : high[x];
      if (Number.isNaN(residual)) continue;
      context.fillStyle = css(RAMPS.ribbon, residual / this.most);
      context.fillRect(x, top, 1, ROW);
    }
  }

  drawEmotions(context, top, width) {
    context.fillStyle = "#1c2026";
    context.fillRect(0, top, width, EMOTIONS);
    const scale = (value) => top + EMOTIONS - 2 - value * (EMOTIONS - 4);
    for (const [name, table] of this.emotions)
      curve(context, table.values, { range: this.range, width, scale, colour: this.colours[name] });
  }
}

/** The residual at the end of the colours: what one frame in fifty of a row exceeds, 2 mm at least [mm]. */
function scaleOf(rows) {
  const tall = rows.map(([, values]) => {
    const known = values.filter((value) => value === value).sort();
    return known[Math.floor(0.98 * (known.length - 1))] ?? 0;
  });
  return Math.max(2, ...tall);
}

/** The frames of the largest residuals, at least `apart` frames from each other. */
export function worstFrames(values, apart, count = 6) {
  const order = Array.from(values.keys()).filter((frame) => !Number.isNaN(values[frame])).sort((a, b) => values[b] - values[a]);
  const chosen = [];
  for (const frame of order) {
    if (chosen.length === count) break;
    if (chosen.every((other) => Math.abs(other - frame) >= apart)) chosen.push(frame);
  }
  return chosen.sort((a, b) => a - b);
}

function niceStep(least) {
  const power = 10 ** Math.floor(Math.log10(Math.max(least, 1)));
  return [1, 2, 5, 10].map((k) => k * power).find((step) => step >= least);
}
