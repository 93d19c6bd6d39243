// The list of campaigns, and the one on show: its tests, its question, its loops.

import { at, attribute, keyed, make, set, show, state } from "./dom.js";
import { on, put, store } from "./feed.js";
import { choice, chooseCampaign, chosen, followRunning } from "./choice.js";
import { act, sayLine } from "./orders.js";
import { swatchOf } from "./charts.js";
import { drawLoops, fetchLoops, hidden, runOf } from "./campaign_loops.js";
import { rigOf } from "./rigs.js";
import { create, get, post, send } from "./send.js";
import { campaignState, moment, part, seconds, shareOf } from "./words.js";

const LISTED = 20; // the stream tells as many
const PAGE = 50;
const NEW_QUESTION_MS = 1000; // before a question that has just come can be answered
const { node: said, say } = sayLine();

function entry(first) {
  const name = make("span", { class: "name" });
  const word = make("span", { class: "state" });
  const hint = make("span", { class: "hint" });
  const bar = make("progress", { max: 1, "aria-label": "Recorded" });
  const button = make("button", { type: "button", class: "choose" }, make("span", { class: "row" }, name, word), hint, bar);
  let campaign = first;
  button.addEventListener("click", () => chooseCampaign(campaign));
  return {
    node: make("li", {}, button),
    update(one) {
      campaign = one;
      attribute(button, "aria-current", String(one.id === choice.campaign));
      set(name, one.name);
      state(word, campaignState(one), colourOf(one));
      set(hint, one.specimen + " on " + one.rig);
      show(bar, one.state === "running");
      bar.value = shareOf(one);
    },
  };
}

const colourOf = (campaign) => campaign.question ? "held" : campaign.state;

function whyItWaits(campaign) {
  const rig = rigOf(campaign);
  if (campaign.state !== "accepted" || !rig) return "";
  if (rig.paused) return "It waits: the queue of its rig is paused: " + rig.paused;
  return rig.out_of_service ? "It waits: its rig is out of service: " + rig.out_of_service : "";
}

function showOne(campaign) {
  set(at("name"), campaign.name);
  state(at("state"), campaignState(campaign), colourOf(campaign));
  const time = campaign.tests.reduce((sum, test) => sum + test.duration_s, 0);
  set(at("facts"), `${campaign.specimen} on ${campaign.rig} · ${campaign.tests.length === 1 ? "1 test" : campaign.tests.length + " tests"}, ` +
    `${seconds(time)} of rig time · accepted ${moment(campaign.created)}` + (campaign.ended ? ` · ended ${moment(campaign.ended)}` : ""));
  const reason = campaign.reason || whyItWaits(campaign);
  show(at("reason"), reason);
  set(at("reason"), reason);
  show(at("retry"), campaign.ended);
  show(at("delete"), campaign.state === "accepted");
  showQuestion(campaign);
  keyed(at("tests"), campaign.tests, (test) => test.name, testRow);
}

function showQuestion(campaign) {
  show(at("question"), campaign.question);
  if (at("asks").textContent === campaign.question) return;
  set(at("asks"), campaign.question);
  at("answer").value = "yes";
  // A second click on the question before must not answer this one.
  const buttons = [...at("question").querySelectorAll("button")];
  for (const button of buttons) button.disabled = true;
  setTimeout(() => { for (const button of buttons) button.disabled = false; }, NEW_QUESTION_MS);
}

function testRow(test) {
  const box = make("input", { type: "checkbox", checked: !hidden.has(test.name) });
  box.addEventListener("change", () => {
    if (box.checked) hidden.delete(test.name);
    else hidden.add(test.name);
    drawLoops();
  });
  const swatch = make("span", { class: "swatch" });
  const label = make("label", { class: "key" }, box, swatch, make("span", {}, test.name));
  const word = make("span", { class: "state" });
  const text = make("div", { class: "text" });
  const bar = make("progress", { max: 1, "aria-label": "Recorded" });
  const file = make("td", { "data-head": "Run file" });
  const link = make("a");
  const cell = (head, ...inner) => make("td", { "data-head": head }, ...inner);
  const node = make("tr", {}, cell("Test", label), cell("Kind", test.kind), cell("Use", test.held_out ? "held out" : "training"),
    cell("State", word, text), cell("Progress", bar), cell("Rig time", seconds(test.duration_s)), file);
  node.children[4].className = "wide";
  node.children[5].className = "number";
  return {
    node,
    update(now) {
      swatch.style.background = swatchOf(chosen() ? chosen().tests.findIndex((one) => one.name === now.name) : 0);
      state(word, now.state === "accepted" ? "waits" : now.state);
      const shown = now.text && ["failed", "aborted", "skipped"].includes(now.state);
      show(text, shown);
      set(text, shown ? now.text : "");
      bar.value = part(now);
      const run = runOf(now.name);
      if (run && link.href !== run.file) {
        attribute(link, "href", run.file);
        set(link, run.status + ", HDF5");
        file.replaceChildren(link);
      } else if (!run) file.replaceChildren();
    },
  };
}

export function showCampaigns() {
  followRunning();
  show(at("none"), store.campaigns.length === 0);
  show(at("older"), older.more && store.campaigns.length >= LISTED);
  keyed(at("campaigns"), store.campaigns, (one) => one.id, entry);
  const campaign = chosen();
  show(at("one"), campaign);
  if (!campaign) return;
  showOne(campaign);
  fetchLoops(campaign, showCampaigns);
}

let shown = null;

on("choice", () => {
  if (shown !== choice.campaign) {
    at("tests").replaceChildren();
    keyed(at("tests"), [], () => "", testRow);
    say("");
  }
  shown = choice.campaign;
  showCampaigns();
});

older.more = true;

async function older() {
  const before = Math.min(store.from, store.campaigns[LISTED - 1].number); // those that wait longer may be far older
  return (await get(`/v1/campaigns?limit=${PAGE}&before=${before}`)).campaigns;
}

async function answer(text) {
  show(at("question"), false);
  try {
    await post(`/v1/campaigns/${choice.campaign}/confirm`, { answer: text, question: at("asks").textContent });
  } catch (error) {
    showCampaigns(); // the question stands again
    throw error;
  }
}

at("question").addEventListener("submit", (event) => {
  event.preventDefault();
  answer(at("answer").value || "yes").catch((error) => say(error.message, "refused"));
});
at("decline").addEventListener("click", () => answer("no").catch((error) => say(error.message, "refused")));
at("one-title").after(said);
at("retry").addEventListener("click", () => act(at("retry"), () => create(`/v1/campaigns/${choice.campaign}/retry`), say,
  (again) => say(`Waits again as ${again.name}.`, "taken")));
at("delete").addEventListener("click", () => act(at("delete"), () => send("DELETE", `/v1/campaigns/${choice.campaign}`), say));
at("older").addEventListener("click", () => act(at("older"), older, say, (found) => {
  found.forEach(put);
  store.from = found.length ? found[found.length - 1].number : 0;
  older.more = found.length === PAGE;
  showCampaigns();
}));
for (const news of ["campaigns", "campaign", "progress", "rigs"]) on(news, showCampaigns);
