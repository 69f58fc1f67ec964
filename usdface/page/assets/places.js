// The places of the markers while they are edited, and the binding file that they become.

export const SURE = 0.8; // confidence from which a proposed place is shown as sure

export class Places {
  /** `markers` as proposed: [{ name, point, confidence, state }]; partners and mirror as indices;
   *  neutral frames as [first, last]. */
  constructor(markers, partners, mirror, { neutral = null, noseTip = "" } = {}) {
    this.markers = markers;
    this.partners = partners;
    this.mirror = mirror;
    this.now = markers.map(({ point, state }) => ({ point, state, by: "proposal" }));
    this.neutral = neutral;
    this.noseTip = noseTip;
    this.past = [];
  }

  get count() {
    return this.markers.length;
  }

  get undoable() {
    return this.past.length > 0;
  }

  /** Remember everything that is edited, before some of it changes. */
  begin() {
    this.past.push(this.snapshot());
    if (this.past.length > 200) this.past.shift();
  }

  /** Forget what `begin` remembered if nothing has changed since; return whether something has. */
  end() {
    if (JSON.stringify(this.past.at(-1)) !== JSON.stringify(this.snapshot())) return true;
    this.past.pop();
    return false;
  }

  undo() {
    if (this.past.length) Object.assign(this, this.past.pop());
  }

  snapshot() {
    return { now: this.now.map((place) => ({ ...place })), neutral: this.neutral, noseTip: this.noseTip };
  }

  /** Bind a marker to a vertex. */
  put(index, point) {
    this.now[index] = { point, state: "bound", by: "hand" };
  }

  /** Bind a marker where it is. */
  accept(index) {
    if (this.now[index].point >= 0) this.now[index] = { ...this.now[index], state: "bound", by: "hand" };
  }

  leaveOut(index) {
    this.now[index] = { ...this.now[index], state: "out", by: "hand" };
  }

  reset(index) {
    const { point, state } = this.markers[index];
    this.now[index] = { point, state, by: "proposal" };
  }

  /** Whether a marker has a partner that is placed. */
  hasPartner(index) {
    const partner = this.partners[index];
    return partner >= 0 && partner !== index && this.shown(partner) >= 0;
  }

  /** Bind a marker opposite its partner; nothing changes without one. */
  fromPartner(index) {
    if (this.hasPartner(index)) this.put(index, this.mirror[this.now[this.partners[index]].point]);
  }

  /** Place the partners of all markers whose vertex is on a side: `decides(vertex)`. */
  mirrorAll(decides) {
    const before = this.now.map((place) => ({ ...place }));
    before.forEach(({ point, state }, index) => {
      const partner = this.partners[index];
      if (partner < 0 || partner === index || point < 0 || state !== "bound" || !decides(point)) return;
      const there = before[partner];
      // A pair that lies on one side is no pair to mirror.
      if (there.state === "bound" && there.point >= 0 && decides(there.point)) return;
      this.put(partner, this.mirror[point]);
    });
  }

  /** The vertex that a marker is shown on, -1 for none. */
  shown(index) {
    const { point, state } = this.now[index];
    return state === "out" ? -1 : point;
  }

  state(index) {
    return this.now[index].state;
  }

  confidence(index) {
    return this.now[index].by === "proposal" ? this.markers[index].confidence : null;
  }

  /** How sure a place is, as the colours tell it. */
  kind(index) {
    const { state, by } = this.now[index], confidence = this.confidence(index);
    if (state === "out" || state === "unsure") return state;
    if (by === "hand") return "hand";
    return confidence === null || confidence >= SURE ? "sure" : "middling";
  }

  describe(index) {
    const { state, by } = this.now[index], confidence = this.confidence(index);
    if (state === "out") return by === "hand" ? "left out" : "no place";
    if (by === "hand") return "by hand";
    const share = confidence === null ? "" : confidence.toFixed(2);
    return state === "unsure" ? `unsure ${share}` : share || "given";
  }

  /** The markers as proposed that need a look first: unsure, then by confidence. */
  order() {
    const rank = ({ state, confidence }) => (state === "unsure" ? -2 : state === "out" ? -1 : (confidence ?? 1));
    return [...this.markers.keys()].sort((a, b) => rank(this.markers[a]) - rank(this.markers[b]) || a - b);
  }
}

/** The text of the binding file: that of the proposal with the places as they are now. */
export function bindDocument(document, places, given) {
  const { neutral, noseTip } = places;
  const markers = Object.create(null), unsure = Object.create(null);
  places.markers.forEach(({ name }, index) => {
    const { point, state } = places.now[index], confidence = places.confidence(index);
    if (state === "out" || point < 0) return;
    (state === "unsure" ? unsure : markers)[name] = confidence === null ? { point } : { point, confidence };
  });
  const { unsure: _, ...rest } = document;
  const result = { ...rest, markers };
  if (Object.keys(unsure).length) result.unsure = unsure;
  // Weights of the neutral frames were estimated for those that were found.
  const same = given && neutral && given[0] === neutral[0] && given[1] === neutral[1];
  result.neutral = neutral === null ? "rig" : same ? document.neutral : { start: neutral[0], end: neutral[1] };
  result.nose_tip = noseTip in markers ? noseTip : "";
  return `${JSON.stringify(result, null, 1)}\n`;
}
