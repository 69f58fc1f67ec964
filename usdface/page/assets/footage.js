// The contact sheet of a filmed take: { box: [left, top, right, bottom], names,
// frames: [{ frame, image, dots: [[x, y, confidence or null] or null, ...] }] }, in pixels.

import { element } from "usdface/dom";

const SVG = "http://www.w3.org/2000/svg";

/** The colour of a confidence: red 0, yellow, green 1; blue where none is known. */
export function shade(confidence) {
  return confidence === null ? "#4ad3ff" : `hsl(${Math.round(120 * Math.min(1, Math.max(0, confidence)))} 90% 55%)`;
}

export class Footage {
  constructor(place, footage, go) {
    const known = footage.frames.some(({ dots }) => dots.some((dot) => dot && dot[2] !== null));
    place.append(element("p", { class: "note", text: known ? "colour: confidence, red 0 to green 1" : "no confidence is known: give the report of the take" }));
    this.figures = footage.frames.map((each) => {
      const hidden = footage.names.filter((_, k) => !each.dots[k]);
      const button = element("button", { type: "button", class: "shot", title: `to frame ${each.frame}`, on: { click: () => go(each.frame) } }, [picture(footage, each)]);
      place.append(button, element("p", { class: "note", text: `frame ${each.frame}${hidden.length ? `; hidden: ${hidden.join(", ")}` : ""}` }));
      return { frame: each.frame, button };
    });
  }

  /** Mark the image that is nearest to the play head. */
  show(frame) {
    const away = this.figures.map((figure) => Math.abs(figure.frame - frame));
    const nearest = away.indexOf(Math.min(...away));
    this.figures.forEach(({ button }, k) => button.setAttribute("aria-pressed", k === nearest));
  }
}

function picture({ box, names }, { image, dots }) {
  const [left, top, right, bottom] = box, size = (right - left) / 40;
  const svg = drawn("svg", { viewBox: `${left} ${top} ${right - left} ${bottom - top}` });
  svg.append(drawn("image", { href: image, x: left, y: top, width: right - left, height: bottom - top, preserveAspectRatio: "none" }));
  dots.forEach((dot, k) => {
    if (!dot) return;
    const [x, y, confidence] = dot, colour = shade(confidence);
    const ring = drawn("circle", { cx: x, cy: y, r: 0.5 * size, fill: "none", stroke: colour, "stroke-width": size / 8 });
    const title = drawn("title", {});
    title.textContent = names[k] + (confidence === null ? "" : `  ${confidence}`);
    ring.append(title);
    const label = drawn("text", { x: x + 0.6 * size, y: y - 0.4 * size, fill: colour, "font-size": 0.75 * size });
    label.textContent = names[k].replace(/^dot_/, "");
    svg.append(ring, label);
  });
  return svg;
}

function drawn(tag, attributes) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}
