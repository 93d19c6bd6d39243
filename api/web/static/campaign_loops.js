// The loops of the campaign on show: those of its captured runs, and of the test that runs.

import { at, show } from "./dom.js";
import { on, store } from "./feed.js";
import { calm, chart, forceScale, ink, lineOf, peakOf, scaled } from "./charts.js";
import { choice, chosen } from "./choice.js";
import { LiveLoop } from "./loops.js";
import { get } from "./send.js";

const BROAD = ["multisine", "homogenised", "road"]; // these cover the plane: drawn thin, below the loops of the others
const DRAW_MS = 200;
const CALM_MS = 2000;
const AGAIN_MS = 2000;
const LEAST_SAMPLES = 64;
const MOST_DRAWN = 40; // runs; a page with more is slow, and nobody tells their colours apart

export const hidden = new Set(); // names of the tests that are not drawn
const live = new LiveLoop();
let loops = new Map(); // run id -> its loops
let runs = new Map(); // test -> its newest run
let of = ""; // the campaign that they belong to
let stand = ""; // how much of it they stand for
let fetching = false;

export const runOf = (test) => runs.get(test);

function forget(campaign) {
  if (campaign.id === of) return;
  of = campaign.id;
  loops = new Map();
  runs = new Map();
  hidden.clear();
  stand = "";
  live.clear();
}

export async function fetchLoops(campaign, then) {
  forget(campaign);
  const ended = campaign.tests.filter((test) => !["waiting", "running"].includes(test.state)).length;
  const now = campaign.id + "/" + ended + campaign.state;
  if (now === stand || fetching) return;
  fetching = true;
  try {
    const found = (await get(`/v1/campaigns/${campaign.id}/runs`)).runs;
    for (const run of found.slice(-MOST_DRAWN).filter((run) => !loops.has(run.id) && run.samples >= LEAST_SAMPLES)) {
      const drawn = await get(run.loops + "?points=1500");
      if (campaign.id !== choice.campaign) return;
      loops.set(run.id, drawn);
    }
    runs = new Map(found.map((run) => [run.test, run]));
    stand = now;
    then();
    drawLoops();
  } catch {
    await new Promise((again) => setTimeout(again, AGAIN_MS)); // the banner says that the service is away
  } finally {
    fetching = false;
  }
}

export function drawLoops() {
  const campaign = chosen();
  if (!campaign) return;
  const shown = [...loops.values()].filter((loop) => !hidden.has(loop.test));
  const isLive = !live.empty && live.campaign === campaign.id && !hidden.has(live.test);
  const some = isLive || shown.length > 0;
  show(at("no-loops"), !some);
  show(at("loops"), some);
  if (!some) return;
  const peak = Math.max(1, ...shown.map((loop) => peakOf(loop.force_n)), isLive ? peakOf(live.f) : 0);
  const [scale, unit] = forceScale(peak);
  const words = (what) => `Force over ${what}: ${shown.length} captured ${shown.length === 1 ? "run" : "runs"}` +
    (isLive ? `, and ${live.test} live` : "") + `, up to ${(peak * scale).toPrecision(3)} ${unit}`;
  const one = (node, what, key, mine, x) => chart(node, {
    title: "Force over " + what, x, y: `Force (${unit})`, kept: campaign.id, words: words(what),
    traces: () => traces(campaign, shown, key, mine, scale, isLive),
  });
  one(at("fx"), "displacement", "displacement_m", live.x, "Displacement (mm)");
  one(at("fv"), "velocity", "velocity_m_s", live.v, "Velocity (mm/s)");
}

function traces(campaign, shown, key, mine, scale, isLive) {
  const kinds = new Map(campaign.tests.map((test) => [test.name, test.kind]));
  const broad = (loop) => BROAD.includes(kinds.get(loop.test));
  const made = [...shown].sort((a, b) => broad(b) - broad(a)).map((loop) => ({
    name: loop.test, x: scaled(loop[key], 1e3), y: scaled(loop.force_n, scale), mode: "lines",
    line: lineOf(campaign.tests.findIndex((test) => test.name === loop.test), broad(loop) ? 0.7 : 1.6),
    opacity: isLive ? 0.45 : broad(loop) ? 0.6 : 1,
  }));
  if (isLive) {
    made.push({ name: live.test + " (live)", x: scaled(mine, 1e3), y: scaled(live.f, scale), mode: "lines",
      line: { width: 1.5, color: ink() }, connectgaps: false });
  }
  return made;
}

const isRunning = (campaign, test) => {
  const one = store.campaigns.find((other) => other.id === campaign);
  return Boolean(one && one.tests.some((other) => other.name === test && other.state === "running"));
};

let waits = false;

function drawSoon() {
  if (waits) return;
  waits = true;
  setTimeout(() => {
    waits = false;
    drawLoops();
  }, calm.matches ? CALM_MS : DRAW_MS);
}

on("samples", (blocks) => {
  const mine = blocks.filter((block) => block.campaign_id === choice.campaign && isRunning(block.campaign_id, block.test));
  mine.forEach((block) => live.take(block));
  if (mine.length) drawSoon();
});

function quiet() {
  if (live.empty || isRunning(live.campaign, live.test)) return;
  live.clear();
  drawSoon();
}

on("campaigns", quiet);
on("campaign", quiet);
on("choice", drawSoon);
