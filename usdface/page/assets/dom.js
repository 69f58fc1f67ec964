// Elements of the page. Text from outside only ever becomes text.

/** Make an element: `properties` are attributes, `text` its text, `on` its listeners. */
export function element(tag, properties = {}, children = []) {
  const made = document.createElement(tag);
  const { text, on, ...attributes } = properties;
  for (const [name, value] of Object.entries(attributes))
    if (value !== undefined && value !== false) made.setAttribute(name, value === true ? "" : value);
  if (text !== undefined) made.textContent = text;
  for (const [name, listener] of Object.entries(on ?? {})) made.addEventListener(name, listener);
  made.append(...children.filter(Boolean));
  return made;
}

/** Fit a canvas to its place on a screen of any density; return its context, in CSS pixels. */
export function fitted(canvas) {
  const { clientWidth: width, clientHeight: height } = canvas;
  const density = Math.min(globalThis.devicePixelRatio || 1, 2);
  const pixels = [Math.max(1, Math.round(width * density)), Math.max(1, Math.round(height * density))];
  if (canvas.width !== pixels[0] || canvas.height !== pixels[1]) [canvas.width, canvas.height] = pixels;
  const context = canvas.getContext("2d");
  context.setTransform(density, 0, 0, density, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}

/** Whether a key is for the control that the keyboard is on, and not for the page. */
export function isForControl({ key, target }) {
  if (/^(INPUT|SELECT)$/.test(target.tagName)) return true;
  return /^(BUTTON|SUMMARY)$/.test(target.tagName) && (key === "Enter" || key === " ");
}

/** Let go of what the mouse has used, so that keys are those of the page again. */
export function mouseKeepsNoFocus() {
  document.addEventListener("click", (event) => event.detail > 0 && event.target.closest("button, summary")?.blur());
  document.addEventListener("change", (event) => event.target.matches("input[type=range], select") && event.target.blur());
}

/** A button that does something at once. */
export function button(text, title, press) {
  return element("button", { type: "button", text, title, on: { click: press } });
}

/** The findings of a page under a heading; nothing where there are none. */
export function findingLines(findings) {
  if (!findings?.length) return [];
  const lines = findings.map(({ code, severity, message, where }) =>
    element("p", { class: `finding ${severity}` }, [element("b", { text: code }), element("span", { text: [where, message].filter(Boolean).join(": ") })]));
  return [element("h2", { text: "findings" }), ...lines];
}

/** A button that stays pressed while `isOn()`; call its `refresh` after a change. */
export function toggle(text, title, isOn, press) {
  const made = button(text, title, press);
  made.refresh = () => made.setAttribute("aria-pressed", isOn());
  made.refresh();
  return made;
}
