// A slider for every blend shape.

import { combined } from "usdface/blend_shapes";
import { element } from "usdface/dom";

export class Sliders {
  /** `changed(weights)` is called with the weights of all shapes; null leaves them to the clip. */
  constructor(place, character, changed) {
    this.character = character;
    this.changed = changed;
    this.weights = null;
    this.filter = element("input", { type: "search", placeholder: "blend shape", "aria-label": "filter sliders by name" });
    this.release = element("button", { type: "button", text: "reset", title: "back to the clip", on: { click: () => this.set(null) } });
    this.list = element("div", { class: "sliders" });
    this.follows = new Set(character.combinations.map(({ shape }) => shape));
    this.rows = character.shapes.map((name, shape) => this.rowOf(name, shape));
    this.list.append(...this.rows.map(({ node }) => node));
    this.filter.addEventListener("input", () => {
      const wanted = this.filter.value.trim().toLowerCase();
      for (const { node, name } of this.rows) node.hidden = !name.toLowerCase().includes(wanted);
    });
    place.append(element("div", { class: "filter" }, [this.filter, this.release]), this.list);
  }

  rowOf(name, shape) {
    const input = element("input", { type: "range", min: 0, max: 1, step: 0.01, value: 0, "aria-label": name, disabled: this.follows.has(shape) });
    const value = element("b", { text: "0.00" });
    input.addEventListener("input", () => {
      const weights = Float32Array.from(this.weights ?? this.played ?? this.character.shapes.map(() => 0));
      weights[shape] = Number(input.value);
      this.set(combined(this.character.combinations, weights));
    });
    const node = element("label", { class: "slider" }, [element("span", { class: "name", text: name, title: name }), input, value]);
    return { node, input, value, name };
  }

  /** Hold these weights; null gives them back to the clip. */
  set(weights) {
    this.weights = weights;
    this.release.disabled = !weights;
    this.changed(weights);
  }

  /** Show weights on the sliders. */
  show(weights) {
    if (!this.weights) this.played = weights;
    const now = this.weights ?? weights;
    this.rows.forEach(({ input, value }, shape) => {
      const text = now[shape].toFixed(2);
      if (value.textContent === text) return;
      value.textContent = text;
      input.value = now[shape];
    });
  }
}
