// What the service tells: one stream of events, the newest lists, and whether it is still heard.

const LOST_MS = 1600; // the service sends something every 0.5 s: three in a row are missing
const LOOK_MS = 100;
const AGAIN_MS = 1000;

// told: the ids of the campaigns that the stream told last; from: the oldest number that a person asked for
export const store = { campaigns: [], told: new Set(), from: Infinity, rigs: [], queues: {}, explanations: [], link: "connecting", heardAt: null };
const listeners = {};

export function on(name, told) {
  (listeners[name] ??= []).push(told);
}

export function tell(name, data) {
  for (const told of listeners[name] ?? []) told(data);
}

let source = null;
let heard = 0; // by the clock that only goes forward

export const silentMs = () => performance.now() - heard;

let begun = 0;

function hear() {
  heard = performance.now();
  store.heardAt = Date.now();
  link("live");
}

function link(now) {
  if (store.link === now) return;
  store.link = now;
  tell("link", now);
}

export function remove(id) {
  store.campaigns = store.campaigns.filter((one) => one.id !== id);
}

export function put(campaign) {
  remove(campaign.id);
  store.campaigns = [...store.campaigns, campaign].sort((a, b) => b.number - a.number);
}

// The stream tells the newest. Others stay until it is known how they ended, and where a person asked for them.
function renew(told) {
  store.told = new Set(told.map((one) => one.id));
  store.campaigns = store.campaigns.filter((one) => !one.ended || one.number >= store.from);
  told.forEach(put);
}

function advance(progress) {
  const campaign = store.campaigns.find((one) => one.id === progress.campaign);
  const test = campaign && campaign.tests[progress.position];
  if (test) Object.assign(test, { phase: progress.phase, samples: progress.samples, text: progress.text });
}

const TAKES = {
  beat() {},
  campaigns(data) { renew(data.campaigns); },
  campaign(data) { put(data); },
  progress(data) { data.forEach(advance); },
  rigs(data) { store.rigs = data.rigs; },
  queues(data) { store.queues = data.queues; },
  explanations(data) { store.explanations = data.explanations; },
  samples() {},
  trouble() {},
};

function open() {
  if (source) source.close();
  source = new EventSource("/v1/live");
  begun = performance.now();
  for (const [name, take] of Object.entries(TAKES)) {
    source.addEventListener(name, (event) => {
      hear();
      const data = event.data ? JSON.parse(event.data) : null;
      take(data);
      if (name !== "beat") tell(name, data);
    });
  }
  source.addEventListener("error", () => { if (heard || performance.now() - begun > LOST_MS) link("lost"); });
}

// The browser's own attempts may wait long, or end for good after a refusal: this opens the stream again itself.
function look() {
  const now = performance.now();
  if (now - Math.max(heard, begun) <= LOST_MS) return;
  link("lost");
  if (now - begun > AGAIN_MS + LOST_MS) open();
}

export function follow() {
  open();
  setInterval(look, LOOK_MS);
}
