// Emotions, and the rules that fire at the play head with the degree of each condition.

import { row } from "usdface/data";
import { element } from "usdface/dom";
import { emotionColours } from "usdface/timeline";

const SHOWN = 6;

export class Emotions {
  constructor(place, shot) {
    this.curves = Object.entries(shot.emotions ?? {});
    const colours = emotionColours(this.curves.map(([name]) => name));
    this.bars = this.curves.map(([name]) => meter(place, name, colours[name]));
  }

  show(frame) {
    this.curves.forEach(([, table], i) => this.bars[i](table.values[frame]));
  }
}

export class Rules {
  constructor(place, shot) {
    this.data = shot.rules;
    this.place = place;
    this.open = new Set();
    this.colours = emotionColours(Object.keys(shot.emotions ?? {}));
    this.views = (this.data?.rules ?? []).map((rule, i) => this.view(rule, i));
    this.none = element("p", { class: "note", text: this.data ? "No rule fires here." : "The layers hold no rules." });
    place.append(this.none);
  }

  view(rule, index) {
    const fill = element("i"), value = element("b");
    const then = rule.then.join(", ");
    const head = element("summary", { title: rule.text }, [
      element("span", { class: "bar" }, [fill]),
      value,
      element("span", { class: "then", text: then }),
      element("span", { class: "of", text: counted(rule.conditions.length) }),
    ]);
    fill.style.background = this.colours[rule.then[0]] ?? "#f2a65a";
    const conditions = rule.conditions.map((number) => this.condition(number));
    const details = element("details", { class: "rule" }, [
      head,
      ...conditions.map(({ line }) => line),
      element("p", { class: "text", text: rule.text }),
    ]);
    details.addEventListener("toggle", () => this.show(this.frame ?? 0));
    return { details, fill, value, conditions, index };
  }

  condition(number) {
    const { marker, variable, axis, term, input } = this.data.conditions[number];
    const fill = element("i"), degree = element("b"), length = element("span", { class: "mm" });
    const text = `${marker || variable} ${axis} ${term.replaceAll("_", " ")}`;
    const line = element("div", { class: "condition", title: text }, [
      element("span", { class: "bar" }, [fill]),
      degree,
      element("span", { class: "name", text }),
      length,
    ]);
    return { line, fill, degree, length, number, input };
  }

  show(frame) {
    this.frame = frame;
    if (!this.data) return;
    const firing = row(this.data.firing, frame);
    const order = this.views.toSorted((a, b) => firing[b.index] - firing[a.index]);
    const shown = order.filter((view) => firing[view.index] >= 0.005).slice(0, SHOWN);
    const kept = shown.map((view) => view.details);
    const there = Array.from(this.place.querySelectorAll("details"));
    if (kept.some((each, i) => each !== there[i]) || kept.length !== there.length)
      this.place.replaceChildren(...kept, ...(kept.length ? [] : [this.none]));
    if (kept.length && !kept.some((each) => each.open) && !this.touched) {
      kept[0].open = true;
      this.touched = true;
    }
    for (const view of shown) this.fill(view, firing[view.index], frame);
  }

  fill(view, fires, frame) {
    view.fill.style.width = `${(100 * fires).toFixed(1)}%`;
    view.value.textContent = fires.toFixed(2);
    if (!view.details.open) return;
    const degrees = row(this.data.degrees, frame), lengths = row(this.data.inputs_mm, frame);
    for (const { fill, degree, length, number, input } of view.conditions) {
      fill.style.width = `${(100 * degrees[number]).toFixed(1)}%`;
      degree.textContent = degrees[number].toFixed(2);
      const millimetres = lengths[input];
      length.textContent = Number.isNaN(millimetres) ? "occluded" : `${millimetres >= 0 ? "+" : ""}${millimetres.toFixed(1)} mm`;
    }
  }
}

function counted(count) {
  return count === 1 ? "1 condition" : `${count} conditions`;
}

function meter(place, name, colour) {
  const fill = element("i"), value = element("b");
  fill.style.background = colour;
  place.append(
    element("div", { class: "meter" }, [
      element("span", { class: "name", text: name }),
      element("span", { class: "bar" }, [fill]),
      value,
    ]),
  );
  return (share) => {
    fill.style.width = `${(100 * Math.min(share, 1)).toFixed(1)}%`;
    value.textContent = share.toFixed(2);
  };
}
