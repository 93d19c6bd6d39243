// The newest points of the running test, in the order of their samples. Pure: no page, no clock.

const KEPT_S = 8;
const MOST_POINTS = 4000;

// block: { campaign_id, test, first, step, rate_hz, displacement_m, velocity_m_s, force_n }
export class LiveLoop {
  constructor() {
    this.clear();
  }

  clear() {
    Object.assign(this, { campaign: "", test: "", next: -1, t: [], x: [], v: [], f: [] });
  }

  get empty() {
    return this.x.length === 0;
  }

  take(block) {
    if (block.campaign_id !== this.campaign || block.test !== this.test) {
      this.clear();
      Object.assign(this, { campaign: block.campaign_id, test: block.test });
    }
    if (block.first < this.next) return; // already here
    if (this.next >= 0 && block.first > this.next) this.gap();
    block.displacement_m.forEach((x, k) => {
      this.t.push((block.first + k * block.step) / block.rate_hz);
      this.x.push(x);
      this.v.push(block.velocity_m_s[k]);
      this.f.push(block.force_n[k]);
    });
    this.next = block.next;
    this.forget();
  }

  gap() { // samples are missing here: nothing is drawn between its two sides
    for (const list of [this.x, this.v, this.f]) list.push(null);
    this.t.push(this.t[this.t.length - 1]);
  }

  forget() {
    const last = this.t[this.t.length - 1];
    let old = this.t.findIndex((t) => t > last - KEPT_S);
    old = Math.max(old, this.t.length - MOST_POINTS, 0);
    if (old > 0) for (const key of ["t", "x", "v", "f"]) this[key] = this[key].slice(old);
  }
}
