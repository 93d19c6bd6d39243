// The page: its views, the news of the service, and which view is on show.

import { at, attribute, rest, set, show } from "./dom.js";
import { follow, on, store } from "./feed.js";
import { showAudit, showKeys } from "./access.js";
import { drawLoops } from "./campaign_loops.js";
import { followRunning } from "./choice.js";
import { showCampaigns } from "./campaigns.js";
import { showCell } from "./cell.js";
import { showRigs } from "./rigs.js";
import { showRuns } from "./runs.js";
import { showSchedule } from "./schedule.js";
import "./explanations.js";
import "./missing.js";
import "./session.js";

const VIEWS = {
  live: () => { showRigs(); showCampaigns(); showCell(); drawLoops(); },
  schedule: showSchedule,
  runs: showRuns,
  keys: showKeys,
  audit: showAudit,
};

function showView() {
  const wanted = location.hash.slice(1);
  const view = VIEWS[wanted] ? wanted : "live";
  for (const name of Object.keys(VIEWS)) {
    show(at(name + "-view"), name === view);
    const link = at("to-" + name);
    if (name === view) attribute(link, "aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  VIEWS[view]();
}

at("skip").addEventListener("click", (event) => {
  event.preventDefault();
  rest(document.querySelector("main:not([hidden])"));
});

on("trouble", (data) => {
  show(at("trouble"), data.detail);
  set(at("trouble"), data.detail ? data.detail + ". Stops still reach the rigs." : "");
});
on("campaigns", followRunning);
on("rigs", () => { if (!store.campaigns.length) followRunning(); });
window.addEventListener("hashchange", showView);
showView();
follow();
