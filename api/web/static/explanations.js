// Explanations on the runs of the campaign that is shown: submit, follow, read the report, schedule the next test.

import { at, keyed, make, set, show, state } from "./dom.js";
import { on, store } from "./feed.js";
import { chosen } from "./choice.js";
import { act, sayLine } from "./orders.js";
import { create, get, post } from "./send.js";
import { takeTests } from "./schedule.js";

let asking = false;

export function showExplanations() {
  const campaign = chosen();
  if (!campaign) return;
  const captured = campaign.tests.some((test) => test.state === "done" && !test.held_out);
  at("ask").disabled = asking || !captured;
  set(at("asked"), asking ? "checking the runs and the model …" : captured ? "" : "possible after a training test is captured");
  keyed(at("explanations"), store.explanations.filter((one) => one.campaign === campaign.id), (one) => one.id, line);
}

function line(first) {
  const name = make("span", { class: "name" });
  const word = make("span", { class: "state" });
  const text = make("p");
  const bar = make("progress", { max: 1, "aria-label": "Done" });
  const links = make("p", { class: "hint" });
  const { node: said, say } = sayLine();
  const cancel = make("button", { type: "button" }, "Cancel");
  cancel.addEventListener("click", () => act(cancel, () => post(`/v1/explanations/${first.id}/cancel`, {}), say));
  let report = "";
  const next = make("button", { type: "button", class: "go" }, "Schedule the next test");
  next.addEventListener("click", () => act(next, () => nextTest(report), say));
  return {
    node: make("li", { class: "explanation" }, make("div", { class: "row" }, name, word), text, bar, links, cancel, next, said),
    update(one) {
      set(name, one.name);
      state(word, one.state);
      set(text, words(one));
      show(bar, one.state === "running");
      bar.value = one.done;
      show(cancel, ["accepted", "running"].includes(one.state));
      show(next, one.state === "done");
      report = one.report;
      if (one.report && !links.firstChild) files(links, one);
    },
  };
}

function words(one) {
  if (one.reason) return one.reason;
  if (one.state === "running") return one.phase;
  if (one.state !== "done" || !one.verdict) return "";
  const found = one.effects.map((e) => `${e.element} (confidence ${e.confidence.toFixed(2)})`).join(", ");
  return one.verdict.replaceAll("_", " ") + (found ? ": " + found : "");
}

function files(links, one) {
  const all = [["Report", one.report_html], ["report.json", one.report], ["evidence.h5", one.evidence], ["model.json", one.model]];
  for (const [text, href] of all.filter(([, href]) => href)) {
    links.append(make("a", { href, target: "_blank", rel: "noopener" }, text), " ");
  }
}

async function nextTest(report) {
  const next = (await get(report)).next_test;
  if (!next.design.kind) throw new Error(next.text || "No further test is worth its rig time.");
  location.hash = "#schedule";
  const { name, rig, specimen } = chosen();
  takeTests([next.design], { name: `${name}, next test`.slice(0, 200), rig, specimen });
}

async function ask(event) {
  event.preventDefault();
  const campaign = chosen();
  const [file] = at("model").files;
  if (!campaign || !file || asking) return;
  asking = true;
  showExplanations();
  let refused = "";
  try {
    let model;
    try {
      model = JSON.parse(await file.text());
    } catch (error) {
      throw new Error(`${file.name}: no JSON (${error.message})`);
    }
    await create("/v1/explanations", { campaign: campaign.id, model });
  } catch (error) {
    refused = error.message;
  }
  asking = false;
  showExplanations();
  show(at("refused"), refused);
  set(at("refused"), refused);
}

at("explain").addEventListener("submit", ask);
for (const news of ["explanations", "campaigns", "campaign", "choice"]) on(news, showExplanations);
