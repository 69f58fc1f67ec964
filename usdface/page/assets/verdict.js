// The verdict on a shot: { grade, reasons: [{ reason, action, frame }] }, where there is one.

import { element } from "usdface/dom";

export function showVerdict(place, verdict, go) {
  place.hidden = !verdict;
  if (!verdict) return;
  const reasons = (verdict.reasons ?? []).map(({ reason, action, frame }) =>
    element("p", {}, [
      element("span", { text: reason }),
      action ? element("span", { class: "action", text: action }) : null,
      Number.isInteger(frame) ? element("button", { type: "button", text: `frame ${frame}`, on: { click: () => go(frame) } }) : null,
    ]),
  );
  const grade = String(verdict.grade);
  place.dataset.grade = grade;
  place.append(element("strong", { text: grade }), ...reasons);
}
