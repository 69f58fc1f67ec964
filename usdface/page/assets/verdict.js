// The verdict on a shot, where the page has one:
// { level: "good" | "look_at" | "not_usable", reasons: [{ message, remedy, frames: [first, last] }] }.

import { element } from "usdface/dom";

/** Show a verdict; `go(frame)` is called for the frames of a reason. */
export function showVerdict(place, verdict, go) {
  place.hidden = !verdict;
  if (!verdict) return;
  const level = String(verdict.level);
  const reasons = (verdict.reasons ?? []).map(({ message, remedy, frames }) =>
    element("p", {}, [
      element("span", { text: message }),
      remedy ? element("span", { class: "action", text: remedy }) : null,
      frames?.length ? element("button", { type: "button", text: `frame ${frames[0]}`, on: { click: () => go(frames[0]) } }) : null,
    ]),
  );
  place.dataset.level = level;
  // Closed at first: the reasons would hide the face.
  const count = reasons.length ? ` (${reasons.length})` : "";
  const summary = element("summary", {}, [element("strong", { text: level.replaceAll("_", " ") + count })]);
  place.append(reasons.length ? element("details", {}, [summary, ...reasons]) : element("strong", { text: level }));
}
