// Campaigns that the stream does not tell: those far back in a long queue, and how those ended that it told before.

import { choice } from "./choice.js";
import { on, put, remove, store, tell } from "./feed.js";
import { oneAtATime } from "./orders.js";
import { Refused, get } from "./send.js";

const PAGE = 200; // the most that the service gives at once

async function readWaiting() {
  for (let before = ""; before !== null;) {
    const page = await get(`/v1/campaigns?state=accepted&limit=${PAGE}${before && "&before=" + before}`);
    page.campaigns.forEach(put);
    before = page.next_before;
  }
}

async function readEnd(id) {
  try {
    put(await get(`/v1/campaigns/${id}`));
  } catch (error) {
    if (!(error instanceof Refused && error.status === 404)) throw error;
    remove(id); // it waited, and somebody has deleted it
    if (choice.campaign === id) choice.kept = null;
  }
}

const look = oneAtATime(async () => {
  const queued = new Set(Object.values(store.queues).flatMap((queue) => queue.campaigns));
  const known = new Set(store.campaigns.map((one) => one.id));
  const open = store.campaigns.filter((one) => !one.ended && !store.told.has(one.id) && !queued.has(one.id));
  const further = [...queued].some((id) => !known.has(id));
  if (!further && !open.length) return;
  try {
    if (further) await readWaiting();
    for (const one of open) await readEnd(one.id);
  } catch {
    return; // the banner says that the service is away; the next news is the next attempt
  }
  tell("campaign", null);
});

on("campaigns", look);
on("queues", look);
