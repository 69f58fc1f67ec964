// The play head: frame, time and timecode of one clip; play, speed and loop.

const TICKS_PER_SECOND = 100_000; // usdface/page/clip_data.py

export class Player {
  constructor() {
    this.listeners = [];
    this.speed = 1;
    this.loop = true;
    this.playing = false;
    this.load({ ticks: { values: [0] }, rate: 24 }, "");
  }

  /** Take a clip; the play head goes to its first frame. */
  load(clip, timecode) {
    this.times = Float64Array.from(clip.ticks.values, (tick) => tick / TICKS_PER_SECOND);
    this.rate = clip.rate;
    this.timecode = timecode;
    this.range = [0, this.count - 1];
    this.seek(0);
  }

  get count() {
    return this.times.length;
  }

  /** Call `listener` after every change. */
  onChange(listener) {
    this.listeners.push(listener);
  }

  seek(frame) {
    this.frame = Math.min(Math.max(Math.round(frame) || 0, 0), this.count - 1);
    this.seconds = this.times[this.frame];
    this.changed();
  }

  step(by) {
    this.pause();
    this.seek(this.frame + by);
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  play() {
    if (this.playing || this.count < 2) return;
    const [first, last] = this.range;
    if (this.frame >= last || this.frame < first) this.seek(first);
    this.playing = true;
    this.before = undefined;
    requestAnimationFrame((now) => this.advance(now));
    this.changed();
  }

  pause() {
    this.playing = false;
    this.changed();
  }

  setSpeed(speed) {
    this.speed = Math.min(Math.max(speed, 0.05), 4);
    this.changed();
  }

  setLoop(on) {
    this.loop = on;
    this.changed();
  }

  /** Play only from one frame to another; without them all. */
  setRange(first = 0, last = this.count - 1) {
    const [low, high] = first <= last ? [first, last] : [last, first];
    this.range = [Math.max(0, Math.round(low)), Math.min(this.count - 1, Math.round(high))];
    this.changed();
  }

  /** The frame at a time [s]: the last one that has begun. */
  frameAt(seconds) {
    let low = 0, high = this.count - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.times[middle] <= seconds + 1e-6) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  advance(now) {
    if (!this.playing) return;
    const passed = this.before === undefined ? 0 : Math.min((now - this.before) / 1000, 0.25);
    this.before = now;
    const [first, last] = this.range;
    const end = this.times[last] + 1 / this.rate;
    let seconds = this.seconds + passed * this.speed;
    if (seconds >= end) {
      if (!this.loop) {
        this.seek(last);
        this.pause();
        return;
      }
      seconds = this.times[first];
    }
    const frame = Math.min(this.frameAt(seconds), last);
    this.seconds = seconds;
    if (frame !== this.frame) {
      this.frame = frame;
      this.changed();
    }
    requestAnimationFrame((next) => this.advance(next));
  }

  changed() {
    for (const listener of this.listeners) listener(this);
  }
}

/** SMPTE timecode of a frame after `start` ("hh:mm:ss:ff", drop frame "hh:mm:ss;ff"); from 0 without one. */
export function timecodeAt(start, seconds, rate) {
  const whole = Math.max(1, Math.round(rate)), dropped = (start || "").includes(";");
  const parts = (start || "").split(/[:;]/).map(Number);
  const [hours = 0, minutes = 0, begin = 0, frames = 0] = parts.every(Number.isFinite) ? parts : [];
  // Drop frame leaves out the first labels of each minute, but not of each tenth.
  const skipped = dropped ? Math.round(whole / 15) : 0, passed = hours * 60 + minutes;
  const first = (passed * 60 + begin) * whole + frames - skipped * (passed - Math.floor(passed / 10));
  const count = Math.round(first + seconds * rate);
  const ten = 600 * whole - 9 * skipped, rest = count % ten;
  const minute = Math.max(0, Math.floor((rest - skipped) / (60 * whole - skipped)));
  const total = count + skipped * (9 * Math.floor(count / ten) + minute);
  const pad = (value) => String(Math.floor(value)).padStart(2, "0");
  const clock = total / whole;
  const words = [pad((clock / 3600) % 24), pad((clock / 60) % 60), pad(clock % 60)];
  return words.join(":") + (dropped ? ";" : ":") + pad(total % whole);
}
