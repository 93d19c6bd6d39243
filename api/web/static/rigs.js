// The rigs: each with its state in words, what it measures, its queue, and the ways to stop it.

import { at, attribute, keyed, make, set, show, state } from "./dom.js";
import { on, store } from "./feed.js";
import { orderButton, sayLine, stopButton } from "./orders.js";
import { queueOf } from "./queue.js";
import { clock, interlock, moment } from "./words.js";
import { choice, chooseRig } from "./choice.js";

export function wordOf(rig) {
  return rig.state;
}

export const nameOf = (rig) => rig.name || rig.url;
export const rigOf = (campaign) => store.rigs.find((rig) => rig.running === campaign.id) ??
  store.rigs.find((rig) => rig.url === campaign.rig);

function rigCard(first) {
  const url = (path) => () => `/v1/rigs/${encodeURIComponent(first.id)}/${path}`;
  const { node: said, say } = sayLine();
  const name = make("span", { class: "name" });
  const word = make("span", { class: "state" });
  const paused = make("span", { class: "state paused" }, "queue paused");
  const choose = make("button", { type: "button", class: "choose", onclick: () => chooseRig(first.id) },
    make("span", { class: "row" }, name, word, paused));
  const text = make("p", { class: "hint" });
  const why = make("p", { class: "reason" });
  const since = make("p", { class: "hint" });
  const reason = make("input", { type: "text", maxlength: 200, placeholder: "Why? (optional)", "aria-label": "Why the queue pauses" });
  const pause = orderButton("Pause queue", url("pause"), say, {
    title: "The campaign that runs goes on; none starts after it", body: () => ({ reason: reason.value }), done: () => { reason.value = ""; } });
  const resume = orderButton("Resume queue", url("resume"), say, {
    title: "Look at the rig first: the campaigns that wait for it start", body: () => ({ reason: "" }) });
  resume.className = "go";
  const safe = stopButton("Make safe", "Make safe", "The rig comes to rest, powers off, and is checked to be without current",
    url("make-safe"), say);
  const queue = queueOf(first.id, say);
  const about = make("dl", { class: "about" });
  const more = make("details", {}, make("summary", {}, "Interlocks, envelope, identity"), about);
  const pausing = make("div", { class: "pausing" }, reason, pause);
  const node = make("li", { class: "rig" }, choose, text, why, since,
    make("div", { class: "buttons" }, resume, safe), said, queue.node, pausing, more);
  return {
    node,
    update(rig) {
      set(name, nameOf(rig));
      state(word, wordOf(rig));
      attribute(choose, "aria-current", String(rig.id === choice.rig));
      set(text, [rig.state_text === rig.state ? "" : rig.state_text, rig.known_at ? "as of " + clock(rig.known_at) : ""].filter(Boolean).join(" · "));
      show(paused, rig.paused);
      show(why, rig.paused);
      set(why, rig.paused ?? "");
      show(since, rig.paused);
      set(since, rig.paused ? "since " + moment(rig.paused_since) + ". Look at the rig before you resume." : "");
      show(resume, rig.paused);
      show(pausing, !rig.paused);
      queue.update(rig);
      facts(about, rig);
    },
  };
}

function facts(about, rig) {
  const limits = rig.envelope && rig.envelope.motion ? rig.envelope.motion : {};
  const lines = [
    ["Address", rig.url],
    ["Identity", [rig.model, rig.serial].filter(Boolean).join(", ") || "it has not said yet"],
    ["Interlocks", rig.interlocks.length ? rig.interlocks.map(interlock).join("; ") : "none registered; those of the campaign hold"],
    ["Envelope", Object.entries(limits).map(([key, value]) => `${key.replaceAll("_", " ")} ${value}`).join(", ") || "none registered"],
    ["Reserved", rig.reserved_by ? `by ${rig.reserved_by} until ${moment(rig.reserved_until)}` : "no"],
    ["In service", rig.out_of_service ? "no: " + rig.out_of_service : "yes"],
  ];
  keyed(about, lines, (line) => line[0], ([term]) => {
    const words = make("dd");
    return { node: make("div", {}, make("dt", {}, term), words), update: (line) => set(words, line[1]) };
  });
}

export function showRigs() {
  keyed(at("rigs"), store.rigs, (rig) => rig.id, rigCard);
  show(at("no-rig"), store.rigs.length === 0);
}

on("rigs", showRigs);
on("queues", showRigs);
on("campaigns", showRigs);
on("campaign", showRigs);
on("choice", showRigs);
