// The queue of one rig: what waits, in order; earlier, later, delete.

import { keyed, make, set, show } from "./dom.js";
import { store } from "./feed.js";
import { act } from "./orders.js";
import { chooseCampaign } from "./choice.js";
import { post, send } from "./send.js";
import { leftOf, seconds } from "./words.js";

export function queueOf(rigId, say) {
  const list = make("ol", { class: "queue", "aria-label": "Queue" });
  const title = make("p", { class: "hint" });
  const row = (first) => queueRow(rigId, first.id, say);
  return {
    node: make("div", {}, title, list),
    update(rig) {
      const queue = store.queues[rigId] ?? { campaigns: [] };
      const waiting = queue.campaigns.map((id, place) => ({
        id, place, of: queue.campaigns.length, campaign: store.campaigns.find((one) => one.id === id) }));
      set(title, rig.accepted === 0 ? "No campaign waits." : rig.accepted === 1 ? "1 campaign waits:" : `${rig.accepted} campaigns wait:`);
      show(list, waiting.length > 0);
      keyed(list, waiting, (one) => one.id, row);
    },
  };
}

function queueRow(rigId, id, say) {
  const name = make("button", { type: "button", class: "plain" });
  const takes = make("span", { class: "hint" });
  const button = (sign, words, doing) => {
    const node = make("button", { type: "button", class: "small", "aria-label": words, title: words }, sign);
    node.addEventListener("click", () => act(node, doing, say));
    return node;
  };
  let place = 0;
  const move = (to) => () => post(`/v1/campaigns/${id}/move`, { position: to() }, { "if-match": `"${(store.queues[rigId] ?? {}).version}"` });
  const earlier = button("↑", "Earlier", move(() => Math.max(0, place - 1)));
  const later = button("↓", "Later", move(() => place + 1));
  const remove = button("Delete", "Delete this campaign from the queue", () => send("DELETE", `/v1/campaigns/${id}`));
  name.addEventListener("click", () => {
    const campaign = store.campaigns.find((one) => one.id === id);
    if (campaign) chooseCampaign(campaign);
  });
  return {
    node: make("li", {}, make("div", { class: "grow" }, name, takes), earlier, later, remove),
    update(one) {
      place = one.place;
      set(name, one.campaign ? one.campaign.name : "campaign " + id.slice(0, 8));
      set(takes, one.campaign ? " " + seconds(leftOf(one.campaign)) : "");
      earlier.setAttribute("aria-disabled", String(place === 0));
      later.setAttribute("aria-disabled", String(place === one.of - 1));
    },
  };
}
