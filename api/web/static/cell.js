// What matters beside the rig, readable from two metres: state, force, temperature, time left, stop.

import { at, attribute, set, show, state } from "./dom.js";
import { on, store } from "./feed.js";
import { chosen, chosenRig } from "./choice.js";
import { act, sayLine, stopButton } from "./orders.js";
import { nameOf, wordOf } from "./rigs.js";
import { post } from "./send.js";
import { ASKS, ampere, campaignState, clock, degrees, force, leftOf, length, part, seconds } from "./words.js";

const HELD_WORDS = ["on hold", "holding …", ASKS];
const { node: said, say } = sayLine();

function running() {
  const rig = chosenRig();
  return rig ? store.campaigns.find((one) => one.id === rig.running) ?? null : null;
}

export function showCell() {
  const rig = chosenRig();
  show(at("cell"), rig);
  if (!rig) return;
  const campaign = running();
  const test = campaign && campaign.tests.find((one) => one.state === "running");
  set(at("cell-rig"), nameOf(rig));
  state(at("cell-state"), wordOf(rig));
  set(at("cell-text"), rig.paused && !campaign ? rig.paused : campaign ? campaign.name : rig.state_text);
  readings(rig.readings ?? {});
  const left = campaign ? leftOf(campaign) : NaN;
  set(at("cell-left"), campaign ? seconds(left) : "–");
  const fifo = rig.progress ? rig.progress.fifo : null;
  set(at("cell-fifo"), Number.isFinite(fifo) ? Math.round(100 * fifo) + " %" : "–");
  const measured = Object.keys(rig.readings ?? {}).length > 0;
  set(at("cell-seen"), rig.known_at ? (measured ? "Measured at " : "Nothing is measured; as of ") + clock(rig.known_at) : "Nothing measured yet");
  showOrders(rig, campaign);
  showTest(test);
}

function readings(values) {
  set(at("cell-force"), force(values.force_n));
  set(at("cell-place"), length(values.displacement_m));
  set(at("cell-current"), ampere(values.current_a));
  set(at("cell-degrees"), degrees(values.temperature_degc));
}

function showOrders(rig, campaign) {
  const ending = campaign && ["stop", "abort"].includes(campaign.asked);
  show(at("hold"), campaign && campaign.asked === "");
  show(at("resume"), campaign && campaign.asked === "hold");
  show(at("stop"), campaign);
  show(at("abort"), campaign);
  set(at("cell-campaign-state"), campaign && (ending || HELD_WORDS.includes(campaignState(campaign))) ? campaignState(campaign)
    : rig.paused ? "queue paused" : "");
}

function showTest(test) {
  show(at("now"), test);
  if (!test) return;
  set(at("nowtest"), test.name);
  set(at("nowphase"), test.phase + (test.text ? ": " + test.text : ""));
  set(at("nowleft"), `${test.samples.toLocaleString()} of ${test.total_samples.toLocaleString()} samples`);
  at("nowbar").value = part(test);
}

// The url is that of the moment of pressing; an order for a campaign that has just ended is refused in words.
const ofCampaign = (order) => () => `/v1/campaigns/${(running() ?? { id: "none" }).id}/${order}`;

function buttons() {
  const stop = stopButton("Stop", "Stop", "The rig comes to rest, travels back to mid-stroke and powers off", ofCampaign("stop"), say);
  stop.id = "stop";
  const abort = stopButton("Abort", "Abort", "The rig comes to rest and powers off where the piston stands", ofCampaign("abort"), say);
  abort.id = "abort";
  const safe = stopButton("Make safe", "Make safe", "Whoever commands it: the rig comes to rest, powers off, and is checked to be without current",
    () => `/v1/rigs/${encodeURIComponent(chosenRig().id)}/make-safe`, say);
  safe.id = "safe";
  at("cell-stops").append(stop, abort, safe);
  at("cell").append(said);
  for (const order of ["hold", "resume"]) {
    at(order).addEventListener("click", () => act(at(order), () => post(ofCampaign(order)()), say));
  }
}

// Old values stay readable, and are called old.
export function showLink(now) {
  const lost = now === "lost";
  attribute(document.body, "class", lost ? "lost" : "");
  set(at("link"), lost ? "connection lost" : now === "live" ? "live" : "connecting …");
  attribute(at("link"), "class", lost ? "link lost" : "link");
  show(at("lost"), lost);
  if (lost) {
    set(at("lost-since"), store.heardAt ? `Last heard at ${clock(store.heardAt)}: everything below is old.` : "It has not answered yet.");
  }
  show(at("cell-old"), lost);
}

buttons();
for (const news of ["rigs", "campaigns", "campaign", "progress", "choice"]) on(news, showCell);
on("link", showLink);

let told = "";

// Said to screen readers when a state changes, and only then.
export function tellChange() {
  const rig = chosenRig();
  const campaign = chosen();
  const words = [rig ? `${nameOf(rig)}: ${wordOf(rig)}` : "", campaign ? `${campaign.name}: ${campaignState(campaign)}` : "",
    campaign && campaign.question].filter(Boolean).join(". ");
  if (words !== told) set(at("told"), words);
  told = words;
}

for (const news of ["rigs", "campaigns", "campaign", "choice"]) on(news, tellChange);
