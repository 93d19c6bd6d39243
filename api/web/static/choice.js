// What the page shows: one rig and one campaign. It follows what runs until a person chooses otherwise.

import { store, tell } from "./feed.js";

export const choice = { rig: null, campaign: null, followed: true };

// Also one that the lists have left: what was known of it last.
export function chosen() {
  const found = store.campaigns.find((one) => one.id === choice.campaign);
  if (found) choice.kept = found;
  return found ?? (choice.kept && choice.kept.id === choice.campaign ? choice.kept : null);
}

export const chosenRig = () => store.rigs.find((one) => one.id === choice.rig) ?? null;

function rigFor(campaign) {
  const rig = store.rigs.find((one) => one.running === campaign.id) ?? store.rigs.find((one) => one.url === campaign.rig);
  return rig ? rig.id : choice.rig;
}

function take(campaign) {
  const before = `${choice.campaign} ${choice.rig}`;
  choice.campaign = campaign ? campaign.id : null;
  if (campaign) choice.rig = rigFor(campaign);
  if (`${choice.campaign} ${choice.rig}` !== before) tell("choice", choice);
}

export function chooseCampaign(campaign) {
  choice.followed = campaign.state === "running";
  choice.kept = campaign;
  take(campaign);
}

export function chooseRig(id) {
  const rig = store.rigs.find((one) => one.id === id);
  if (!rig) return;
  choice.rig = id;
  choice.byPerson = true;
  const own = store.campaigns.find((one) => one.id === rig.running) ?? store.campaigns.find((one) => one.rig === rig.url);
  choice.followed = Boolean(own && own.state === "running");
  choice.campaign = own ? own.id : null;
  tell("choice", choice);
}

// After every news: what runs is shown where nobody has chosen.
export function followRunning() {
  const running = store.campaigns.find((one) => one.state === "running");
  if (choice.followed && running) return take(running);
  if (!chosen() && store.campaigns.length && !choice.byPerson) return take(store.campaigns[0]);
  if (!choice.rig && store.rigs.length) {
    const campaign = chosen();
    choice.rig = campaign ? rigFor(campaign) ?? store.rigs[0].id : store.rigs[0].id;
    tell("choice", choice);
  }
}
