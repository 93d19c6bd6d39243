// What the service tells: one stream of events, the newest lists, and whether it is still heard.

const LOST_MS = 1600; // the service sends something every 0.5 s: three in a row are missing
const LOOK_MS = 100;
const AGAIN_MS = 1000;

export const store = { campaigns: [], rigs: [], queues: {}, explanations: [], link: "connecting", heardAt: null };
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

// Older campaigns that a person asked for stay; the stream tells the newest.
function renew(told) {
  const oldest = told.length ? told[told.length - 1].number : 0;
  store.campaigns = [...told, ...store.campaigns.filter((one) => one.number < oldest)];
}

function replace(campaign) {
  const place = store.campaigns.findIndex((one) => one.id === campaign.id);
  if (place < 0) store.campaigns = [campaign, ...store.campaigns];
  else store.campaigns[place] = campaign;
}

function advance(progress) {
  const campaign = store.campaigns.find((one) => one.id === progress.campaign);
  const test = campaign && campaign.tests[progress.position];
  if (test) Object.assign(test, { phase: progress.phase, samples: progress.samples, text: progress.text });
}

const TAKES = {
  beat() {},
  campaigns(data) { renew(data.campaigns); },
  campaign(data) { replace(data); },
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
